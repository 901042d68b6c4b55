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

// Some rows of one channel of two pictures.
struct SsimRows {
  const float* a;  // [H,W]
  const float* b;  // [H,W]
  int width;       // pixels
  int height;      // pixels, of the whole channel: rows outside [0, height) count as 0
  int first;       // the rows [first, last)
  int last;
  const uint8_t* ignored = nullptr;  // [H,W] 1: the pixel does not count; null: all count
};

// Σ (1 − SSIM) over the pixels of the rows that count: small for pictures that are alike, so that floats keep its
// digits.
double SumOfDissimilarity(const SsimRows& rows);

}  // namespace anchorsplat
