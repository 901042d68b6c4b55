#pragma once

#include <string>
#include <vector>

#include "core/cloud_view.h"
#include "formats/registry.h"

namespace anchorsplat {

// What of this cloud a format has no place for, beyond the rounding that every cloud gets (docs/formats.md): harmonics
// that are dropped, values that are clamped to the format's range, a render mode that it cannot say, credits that it
// has no place for, means that are made coarse by where they are. A sentence each, for people; nothing when all is
// well. WriteCloud says them as warnings. What nobody draws is not counted.
std::vector<std::string> WriteLosses(const SplatFormat& format, const CloudView& cloud);

// Largest side of a box that holds the middle of the means on every axis, 98 % of them or another share, and its
// farthest coordinate from zero; estimated from at most 65,536 of them. Zeros when none is usable.
struct MiddleOfMeans {
  float extent = 0, farthest = 0;  // world units
};
MiddleOfMeans FindMiddleOfMeans(const CloudView& cloud, double share = 0.98);

}  // namespace anchorsplat
