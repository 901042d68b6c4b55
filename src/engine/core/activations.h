#pragma once

#include <cmath>

namespace anchorsplat {

// Between what a splat stores (logits, logarithms; core/gaussian_cloud.h) and what it means (opacities, lengths).

// Opacity in 0–1 of a stored logit; ±∞ are its ends.
inline float Sigmoid(float logit) { return 1.0f / (1.0f + std::exp(-logit)); }
inline double Sigmoid(double logit) { return 1.0 / (1.0 + std::exp(-logit)); }

// Its logarithm, without overflow or loss for logits of either sign.
inline float LogSigmoid(float logit) {
  return logit < 0 ? logit - std::log1p(std::exp(logit)) : -std::log1p(std::exp(-logit));
}
inline double LogSigmoid(double logit) {
  return logit < 0 ? logit - std::log1p(std::exp(logit)) : -std::log1p(std::exp(-logit));
}

// Logit of an opacity stored in 0–1. The ends become ∓13.8 (opacity 1e-6 and 1 − 1e-6), as infinite logits trip other
// programs and a byte cannot tell 1 from 0.999 anyway.
inline float LogitFromOpacity(float opacity) {
  constexpr float kEnd = 1e-6f;
  const float inside = opacity > kEnd ? (opacity < 1 - kEnd ? opacity : 1 - kEnd) : kEnd;  // NaN: invisible
  return std::log(inside / (1 - inside));
}

// ln of a scale stored as a length; zero, negative and NaN lengths become −Inf, a Gaussian without extent.
inline float LogFromScale(float scale) { return scale > 0 ? std::log(scale) : -INFINITY; }

}  // namespace anchorsplat
