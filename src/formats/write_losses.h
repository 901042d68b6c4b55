#pragma once

#include <string>
#include <vector>

#include "core/cloud_view.h"
#include "formats/registry.h"

namespace anchorsplat {

// What of this cloud a format has no place for, beyond the rounding that every cloud gets (docs/formats.md): harmonics
// that are dropped, values that are clamped to the format's range, a render mode that it cannot say, credits that it
// has no place for, means that one stray Gaussian makes coarse. A sentence each, for people; nothing when all is well.
// WriteCloud says them as warnings. Values that are not numbers are not counted.
std::vector<std::string> WriteLosses(const SplatFormat& format, const CloudView& cloud);

// Largest side of a box that holds the middle 98 % of the means on every axis, and its farthest coordinate from zero;
// estimated from at most 65,536 of them. Zeros when none is finite.
struct MiddleOfMeans {
  float extent = 0, farthest = 0;  // world units
};
MiddleOfMeans FindMiddleOfMeans(const CloudView& cloud);

}  // namespace anchorsplat
