#pragma once

#include <array>

#include "enhance/pixel_size_features.h"

namespace anchorsplat {

// ln(true pixel size / d) from the features of pixels of d, by ridge regression: intercept + Σ weight · (feature −
// mean) / deviation. `error` is the standard deviation of the final estimate's logarithm on objects left out of the
// regression. Written by scripts/train-pixel-size.py.
struct PixelSizeCoefficients {
  std::array<double, kPixelSizeFeatures> mean, deviation, weight;
  double intercept, error;
};
extern const PixelSizeCoefficients kPixelSizeCoefficients;

}  // namespace anchorsplat
