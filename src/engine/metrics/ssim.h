#pragma once

#include <array>
#include <cstdint>

namespace anchorsplat {

// The window of Wang et al. 2004: 11 samples of a Gaussian with σ 1.5, sum 1.
inline constexpr int kSsimRadius = 5;
inline constexpr int kSsimTaps = 2 * kSsimRadius + 1;
inline constexpr double kSsimSigma = 1.5;
inline constexpr float kSsimC1 = 0.01f * 0.01f;
inline constexpr float kSsimC2 = 0.03f * 0.03f;

const std::array<float, kSsimTaps>& SsimWindow();

// Rows of one channel of two images.
struct SsimRows {
  const float* a;  // [H,W]
  const float* b;  // [H,W]
  int width;       // pixels
  int height;      // pixels, whole channel; rows outside count as 0
  int first;       // rows [first, last)
  int last;
  const uint8_t* ignored = nullptr;  // [H,W] 1: ignored; null: none
};

// Σ (1 − SSIM) over the rows' pixels that count. It is small for similar images, so floats keep its precision.
double SumOfDissimilarity(const SsimRows& rows);

}  // namespace anchorsplat
