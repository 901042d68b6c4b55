#pragma once

#include <cstdint>
#include <functional>
#include <optional>

#include "core/buffer.h"
#include "core/cloud_view.h"
#include "core/framing.h"

namespace anchorsplat {

// A format that spends its few bits for positions on the way to what is far out has none left for all others. Which of
// the two is the smaller loss is weighed here: Gaussians count by what of a view from the middle they cover, and a
// rounded position costs as much of that as it is of the Gaussian's own size.

// Rows that are given up so that the others stay where they are, and the largest distance of one from the middle.
struct Strays {
  Buffer<int64_t> rows;  // ascending
  double farthest = 0;   // world units
};

// The framing of a cloud of which a Gaussian may be far out (IsFarOut); nothing where that is plain to see without.
std::optional<Framing> FramingWithFarOut(const CloudView& cloud);

// Opacity × area as seen from the middle, with its radius as the least distance; 0 of what is not drawn.
double SeenWeight(const CloudView& cloud, int64_t row, const Framing& framing);
// Middle length of the two longest axes, world units.
double SizeOf(const CloudView& cloud, int64_t row);
// Share of a Gaussian of `size` that is lost where its position is rounded to multiples of `step`, 0–1.
double RoundingLoss(double step, double size);
// Losses below this share of all that is seen are no reason to give up a Gaussian.
inline constexpr double kLossThatShows = 0.05;

// For a format with one range for all positions: what to give up of the farthest ones. Positions whose coordinates have
// magnitudes of at most `reach` are rounded to multiples of step(reach) · grain(own reach).
Strays FarthestToGiveUp(const CloudView& cloud, const std::function<double(double)>& step,
                        const std::function<double(double)>& grain);

}  // namespace anchorsplat
