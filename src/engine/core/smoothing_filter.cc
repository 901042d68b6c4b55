#include "core/smoothing_filter.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/activations.h"
#include "core/parallel.h"

namespace anchorsplat {

namespace {

constexpr int64_t kSmoothedRows = 4096;

}  // namespace

double Smoothing::Transmittance(double opacity_logit) const {
  return Sigmoid(-opacity_logit) + Sigmoid(opacity_logit) * -std::expm1(log_opacity_factor);
}

Smoothing SmoothingOf(const float* log_scales, double size) {
  Smoothing out;
  const double log_size = std::log(size);
  for (size_t a = 0; a < 3; ++a) {
    const double s = log_scales[a];
    out.log_scales[a] = std::max(s, log_size) + 0.5 * std::log1p(std::exp(-2 * std::abs(s - log_size)));
    out.shares[a] = 1 / (1 + std::exp(2 * (log_size - s)));
    out.log_opacity_factor += s - out.log_scales[a];
  }
  return out;
}

void Smooth(const GaussianCloud& cloud, std::span<const float> sizes, float* log_scales, float* opacity_logits) {
  ParallelFor(0, cloud.size(), kSmoothedRows, [&](int64_t begin, int64_t end) {
    for (auto i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) {
      const float* s = cloud.log_scales.data() + 3 * i;
      const float logit = cloud.opacity_logits[i];
      if (!(sizes[i] > 0)) {
        if (s != log_scales + 3 * i) std::copy_n(s, 3, log_scales + 3 * i);
        opacity_logits[i] = logit;
        continue;
      }
      const Smoothing smoothing = SmoothingOf(s, double{sizes[i]});
      const double left = smoothing.Transmittance(double{logit});
      opacity_logits[i] = static_cast<float>(smoothing.log_opacity_factor + LogSigmoid(double{logit}) - std::log(left));
      for (size_t a = 0; a < 3; ++a) log_scales[3 * i + a] = static_cast<float>(smoothing.log_scales[a]);
    }
  });
}

}  // namespace anchorsplat
