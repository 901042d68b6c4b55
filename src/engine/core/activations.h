#pragma once

#include <cmath>

namespace anchorsplat {

// Conversions between what a splat stores (logits, logarithms; core/gaussian_cloud.h) and opacities and lengths.

// Opacity in 0–1 from a stored logit; −∞ gives 0, +∞ gives 1.
inline float Sigmoid(float logit) { return 1.0f / (1.0f + std::exp(-logit)); }
inline double Sigmoid(double logit) { return 1.0 / (1.0 + std::exp(-logit)); }

// ln Sigmoid(logit), without overflow or cancellation for logits of either sign.
inline float LogSigmoid(float logit) {
  return logit < 0 ? logit - std::log1p(std::exp(logit)) : -std::log1p(std::exp(-logit));
}
inline double LogSigmoid(double logit) {
  return logit < 0 ? logit - std::log1p(std::exp(logit)) : -std::log1p(std::exp(-logit));
}

// Logit of an opacity in 0–1, clamped to ±13.8 (opacity 1e-6 and 1 − 1e-6): infinite logits trip other programs, and a
// byte cannot tell 1 from 0.999. NaN gives −13.8.
inline float LogitFromOpacity(float opacity) {
  constexpr float kEnd = 1e-6f;
  const float inside = opacity > kEnd ? (opacity < 1 - kEnd ? opacity : 1 - kEnd) : kEnd;
  return std::log(inside / (1 - inside));
}

// ln of a length. Zero, negative and NaN give −Inf, a Gaussian without extent.
inline float LogFromScale(float scale) { return scale > 0 ? std::log(scale) : -INFINITY; }

}  // namespace anchorsplat
