#pragma once

#include <array>

#include "enhance/pixel_size_features.h"

namespace anchorsplat {

// ln(true pixel size / d) from the features of pixels of d, by ridge regression: intercept + Σ weight · (feature −
// mean) / deviation. `error` is the standard deviation of the final estimate's logarithm on objects left out of the
// regression. Written by scripts/train-pixel-size.py.
template <size_t kFeatures>
struct PixelSizeCoefficients {
  std::array<double, kFeatures> mean, deviation, weight;
  double intercept, error;
};

// Of standard fits: the features of Look::kAlpha.
extern const PixelSizeCoefficients<kPixelSizeFeatures> kStandardPixelSize;

// Of fits of many kinds: the features of Look::kAlpha and Look::kAntialiased, and SizeFeatures without the number of
// Gaussians, which says more about the picture's size than about its pixels.
inline constexpr size_t kKindsPixelSizeFeatures = 2 * kPixelSizeFeatures + kSizeFeatures - 1;
extern const PixelSizeCoefficients<kKindsPixelSizeFeatures> kKindsPixelSize;

// What is still wrong where the two end: kernel ridge regression of ln(true pixel size / estimate) on the features of
// Look::kAlpha and SizeFeatures without the number of Gaussians, at the estimate: intercept + Σ weight · z +
// Σ height · exp(−½ |z − landmark|² / number of features), z = (feature − mean) / deviation.
inline constexpr size_t kCorrectionFeatures = kPixelSizeFeatures + kSizeFeatures - 1;
inline constexpr size_t kCorrectionLandmarks = 64;
struct PixelSizeCorrection {
  std::array<double, kCorrectionFeatures> mean, deviation, weight;
  double intercept;
  std::array<double, kCorrectionLandmarks> height;
  std::array<std::array<float, kCorrectionFeatures>, kCorrectionLandmarks> landmark;
};
extern const PixelSizeCorrection kPixelSizeCorrection;

// ln(true pixel size / estimate) of what is left then, learned from fits to soft pictures, too: features as there.
extern const PixelSizeCoefficients<kCorrectionFeatures> kSoftPixelSize;

// Of antialiased fits: the features of Look::kAntialiased and SizeFeatures without the number of Gaussians; and what is
// still wrong where that ends.
inline constexpr size_t kAntialiasedPixelSizeFeatures = kPixelSizeFeatures + kSizeFeatures - 1;
extern const PixelSizeCoefficients<kAntialiasedPixelSizeFeatures> kAntialiasedPixelSize;
extern const PixelSizeCorrection kAntialiasedPixelSizeCorrection;

}  // namespace anchorsplat
