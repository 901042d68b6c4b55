#pragma once

#include <cstdint>
#include <functional>
#include <optional>

#include "core/buffer.h"
#include "core/cloud_view.h"
#include "core/framing.h"

namespace anchorsplat {

// Formats with few bits for positions lose precision everywhere if they must reach distant Gaussians. Which loss is
// smaller is decided here: Gaussians weigh by the area they cover as seen from the middle, and rounding a position
// costs the fraction of that weight by which it shifts the Gaussian relative to its size.

// Rows to hide so that the others stay precise, and the largest distance of one from the middle.
struct Strays {
  Buffer<int64_t> rows;  // ascending
  double farthest = 0;   // world units
};

// The framing of a cloud that may have distant Gaussians (IsFarOut); none if it obviously has none.
std::optional<Framing> FramingWithFarOut(const CloudView& cloud);

// Opacity × area seen from the middle, with the framing's radius as minimum distance; 0 if not drawn.
double VisibleWeight(const CloudView& cloud, int64_t row, const Framing& framing);
// Geometric mean of the two longest axes, world units.
double SizeOf(const CloudView& cloud, int64_t row);
// Fraction (0–1) of a Gaussian of `size` lost by rounding its position to multiples of `step`.
double RoundingLoss(double step, double size);
// Gaussians are hidden only if that saves more than this fraction of the visible total.
inline constexpr double kVisibleLoss = 0.05;

// For formats with one range for all positions: the most distant Gaussians to hide. Coordinates up to `reach` are
// rounded to multiples of step(reach) · grain(own reach).
Strays ChooseStrays(const CloudView& cloud, const std::function<double(double)>& step,
                    const std::function<double(double)>& grain);

}  // namespace anchorsplat
