#pragma once

#include <vector>

#include "core/gaussian_cloud.h"
#include "core/random.h"
#include "formats/random_cloud_for_test.h"

namespace anchorsplat {

// SH in clusters of varying spread, like those of a scene.
inline GaussianCloud Clustered(int64_t n, int degree, uint64_t seed) {
  GaussianCloud cloud = RandomCloud(n, degree, seed);
  Random random(seed + 1);
  const int64_t centres = 300;
  std::vector<float> centre(static_cast<size_t>(centres * cloud.sh_stride()));
  for (float& x : centre) x = static_cast<float>(0.2 * random.Normal());
  for (int64_t i = 0; i < n; ++i) {
    const int64_t c = random.Below(centres);
    const double spread = 0.02 + 0.1 * random.Uniform();
    for (int64_t k = 0; k < cloud.sh_stride(); ++k) {
      float& x = cloud.sh[static_cast<size_t>(i * cloud.sh_stride() + k)];
      x = centre[static_cast<size_t>(c * cloud.sh_stride() + k)] + static_cast<float>(spread) * x;
    }
  }
  return cloud;
}

}  // namespace anchorsplat
