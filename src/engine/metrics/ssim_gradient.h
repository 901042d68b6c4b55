#pragma once

#include "core/image.h"

namespace anchorsplat {

// Columns per task: eleven rows of all intermediates nearly fit in the L1 cache.
inline constexpr int kSsimStrip = 128;

// Gradient of SSIM and of the absolute difference with respect to the first image, and their sums, over a rectangle of
// one channel.
//
// With images a and b, d = a − b, and local means with the window of ssim.h:
//   δ = μ_a − μ_b,  n₁ = 2 μ_a μ_b + C₁,  e₁ = n₁ + δ²,  n₂ = 2 cov(a, b) + C₂,  e₂ = n₂ + var(d),  SSIM = n₁n₂/(e₁e₂).
// Four means (of a, d, d² and ab) suffice, and similar images lose no precision to cancellation. The gradient of a
// pixel sums over the windows that contain it; with ∗ convolution by the same window,
//   P∗ + 2 (a − b)·Q∗ + b·R∗,
//   Q = ∂SSIM/∂var(a),  R = ∂SSIM/∂cov(a, b) + 2 Q,  P = ∂SSIM/∂μ_a − 2 μ_a Q − μ_b (R − 2 Q).
struct SsimGradientTask {
  const float* a;     // [H,W]
  const float* b;     // [H,W]
  int width;          // W
  int height;         // H; outside of the image counts as 0
  PixelBox map;       // pixels whose SSIM counts; windows of all others must see equal pixels or not count
  PixelBox out;       // where the gradient is written, at most kSsimStrip columns; nearby parts of `map` are read too
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
