#include "fit/regularizers.h"

#include <cmath>

#include "core/activations.h"
#include "core/parallel.h"

namespace anchorsplat {

void AddRegularizers(const Regularizers& regularizers, double unit, const FarUnits& far, const GaussianCloud& cloud,
                     CloudGradient& gradient) {
  if (cloud.empty() || (regularizers.opacity_reg == 0 && regularizers.scale_reg == 0)) return;
  const auto n = static_cast<double>(cloud.size());
  const auto by_opacity = static_cast<float>(regularizers.opacity_reg / n);
  const auto by_scale = static_cast<float>(regularizers.scale_reg / (3 * n * unit));
  ParallelFor(0, cloud.size(), 4096, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      if (!IsUsable(cloud, i)) continue;
      const auto k = static_cast<size_t>(i);
      const float opacity = Sigmoid(cloud.opacity_logits[k]);
      gradient.opacity_logits[k] += by_opacity * opacity * (1 - opacity);
      const auto here = static_cast<float>(by_scale / far.FactorAt(cloud.means.data() + 3 * k));
      for (size_t a = 3 * k; a < 3 * k + 3; ++a) gradient.log_scales[a] += here * std::exp(cloud.log_scales[a]);
    }
  });
}

}  // namespace anchorsplat
