#pragma once

#include <cmath>
#include <span>
#include <string>

#include "core/gaussian_cloud.h"
#include "core/random.h"
#include "network/weights.h"

namespace anchorsplat {

// Flat Gaussians on a wavy sheet about 100 pixels of size 0.01 wide, like a fitted surface.
inline GaussianCloud SheetCloud(int64_t n, int sh_degree = 3, uint64_t seed = 1) {
  GaussianCloud cloud;
  cloud.Resize(n, sh_degree);
  Random random(seed);
  for (int64_t i = 0; i < n; ++i) {
    float* mean = cloud.means.data() + 3 * i;
    mean[0] = static_cast<float>(random.Uniform(-0.5, 0.5));
    mean[1] = static_cast<float>(random.Uniform(-0.5, 0.5));
    mean[2] = static_cast<float>(0.1 * std::sin(7.0 * mean[0]) + 0.05 * mean[1] * mean[1]);
    for (int64_t a = 0; a < 3; ++a) {
      cloud.log_scales[static_cast<size_t>(3 * i + a)] =
          static_cast<float>((a == 2 ? -7 : -4.2) + 0.3 * random.Normal());
    }
    float* q = cloud.quats.data() + 4 * i;
    q[0] = 2;
    for (int c = 1; c < 4; ++c) q[c] = static_cast<float>(0.3 * random.Normal());
    cloud.opacity_logits[static_cast<size_t>(i)] = static_cast<float>(1 + 2 * random.Normal());
  }
  for (float& x : cloud.sh) x = static_cast<float>(0.05 * random.Normal());
  for (int64_t i = 0; i < n; ++i) {
    const float* mean = cloud.means.data() + 3 * i;
    for (int64_t c = 0; c < 3; ++c) {
      cloud.sh.data()[i * cloud.sh_stride() + c] =
          static_cast<float>(std::sin(9.0 * mean[0] + 5.0 * mean[1] + static_cast<double>(c)) + 0.1 * random.Normal());
    }
  }
  return cloud;
}
inline constexpr float kSheetPixel = 0.01f;

// Wraps weights so that every Gaussian is within the training data.
inline WeightSource OpenDomain(WeightSource source = HashWeights()) {
  return [source = std::move(source)](const TensorSpec& tensor, std::span<float> values) -> Status {
    if (!tensor.name.starts_with("domain.")) return source(tensor, values);
    for (float& x : values) x = tensor.name == "domain.low" ? -100.0f : 100.0f;
    return {};
  };
}

}  // namespace anchorsplat
