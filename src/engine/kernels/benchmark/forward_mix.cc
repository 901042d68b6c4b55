#include "kernels/benchmark/forward_mix.h"

#include <algorithm>
#include <cmath>

#include "core/random.h"

namespace anchorsplat {

std::vector<int32_t> SurfaceVoxels(int64_t count) {
  Random random(918);
  std::vector<int32_t> voxels;
  const double radius = 0.63 * std::sqrt(static_cast<double>(count));
  const double centre = radius * 1.1;
  for (int64_t i = 0; i < count; ++i) {
    double direction[3];
    double norm = 0;
    for (double& x : direction) {
      x = random.Normal();
      norm += x * x;
    }
    const double bump = radius * (1 + 0.01 * random.Normal()) / std::sqrt(norm);
    for (double x : direction) voxels.push_back(static_cast<int32_t>(std::max(0.0, centre + bump * x)));
  }
  return voxels;
}

}  // namespace anchorsplat
