#pragma once

#include "core/image.h"

namespace anchorsplat {

// Columns that are worked on at once: eleven rows of all intermediate values stay in the L1 cache, or nearly.
inline constexpr int kSsimStrip = 128;

// A rectangle of one channel of two pictures: the gradient of SSIM and of the absolute difference with respect to the
// first one, and its part of their sums.
//
// With a and b the pictures, d = a − b, and local means by the window of ssim.h:
//   δ = μ_a − μ_b,  n₁ = 2 μ_a μ_b + C₁,  e₁ = n₁ + δ²,  n₂ = 2 cov(a, b) + C₂,  e₂ = n₂ + var(d),  SSIM = n₁n₂/(e₁e₂).
// Four means (of a, d, d² and ab) are enough, and pictures that are alike do not lose their digits in differences of
// large numbers. A pixel's gradient is, of the windows that it is under, with ∗ the same window again,
//   P∗ + 2 (a − b)·Q∗ + b·R∗,  Q = ∂SSIM/∂var(a),  R = ∂SSIM/∂cov(a, b) + 2 Q,  P = ∂SSIM/∂μ_a − 2 μ_a Q − μ_b (R − 2
//   Q).
struct SsimGradientTask {
  const float* a;  // [H,W]
  const float* b;  // [H,W]
  int width;       // W
  int height;      // H; what lies outside of the picture counts as 0
  PixelBox map;    // the pixels whose SSIM counts; the windows of all others must see equal pixels or not count at all
  PixelBox out;    // where to write the gradient, at most kSsimStrip columns; what else of `map` is near is read, too
  float ssim_weight;  // gradient = ssim_weight·∂ΣSSIM/∂a + difference_weight·sign(a − b)
  float difference_weight;
  float* gradient;  // [H,W]
};

struct SsimGradientSums {
  double dissimilarity = 0;  // Σ (1 − SSIM) over `map` within `out`
  double difference = 0;     // Σ |a − b| over `out`
};

SsimGradientSums SsimGradient(const SsimGradientTask& task);

}  // namespace anchorsplat
