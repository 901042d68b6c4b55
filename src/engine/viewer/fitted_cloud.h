#pragma once

#include <cmath>
#include <cstdint>

#include "core/gaussian_cloud.h"
#include "core/random.h"

namespace anchorsplat {

// A cloud that resembles a fitted one, with all values spread over their usual ranges: the worst case for compression.
inline GaussianCloud FittedLookingCloud(int64_t n, int sh_degree, uint64_t seed) {
  Random random(seed);
  GaussianCloud cloud;
  cloud.Resize(n, sh_degree);
  for (float& x : cloud.means) x = static_cast<float>(random.Normal() * 0.3);
  for (float& s : cloud.log_scales) s = static_cast<float>(-4.5 + random.Normal());
  for (float& q : cloud.quats) q = static_cast<float>(random.Normal());
  for (float& o : cloud.opacity_logits) o = static_cast<float>(random.Normal() * 3);
  const auto stride = static_cast<size_t>(cloud.sh_stride());
  for (size_t i = 0; i < cloud.sh.size(); ++i) {
    cloud.sh[i] = static_cast<float>(random.Normal() * (i % stride < 3 ? 0.8 : 0.08));
  }
  return cloud;
}

}  // namespace anchorsplat
