#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace anchorsplat {

// World coordinates in double, means in float: a splat's world position is origin + mean. The origin is zero unless the
// coordinates are so large beside the splat's detail that floats would be too coarse for them, as those of maps are.
// Cameras, regions and everything that people say are world coordinates.
using WorldOrigin = std::array<double, 3>;  // world units

inline bool IsZero(const WorldOrigin& origin) { return origin[0] == 0 && origin[1] == 0 && origin[2] == 0; }

// `point` as seen from the origin, and back.
std::array<double, 3> FromOrigin(const std::array<double, 3>& point, const WorldOrigin& origin);
std::array<double, 3> ToWorld(const float* mean, const WorldOrigin& origin);

// An origin for points in world units, [M,3], of which nothing smaller than `detail` matters: near their middle, in
// round numbers. Zero where floats are fine enough at that distance: their steps there are below a 256th of `detail`.
// Points that are not finite do not count.
WorldOrigin ChooseOrigin(std::span<const double> points, double detail);
// The same where only the points say how large things are: 128 details are the median distance from their middle. For
// the centres of cameras; fewer than two say nothing.
WorldOrigin ChooseOrigin(std::span<const double> points);

// "500000 4500000 120": as short as reads back the same. Nothing for other than three finite numbers up to 1e15, beyond
// which doubles are too coarse as well.
std::string TextOf(const WorldOrigin& origin);
std::optional<WorldOrigin> OriginOf(std::string_view text);

// The comment by which a file of ours says the origin of its means, and what such a comment says; nothing where it is
// none, or a broken one.
std::string OriginComment(const WorldOrigin& origin);
std::optional<WorldOrigin> OriginOfComment(std::string_view comment);
bool IsOriginComment(std::string_view comment);  // broken or not
// Takes such comments out of the others. Zero where there is none; of several the last one counts.
WorldOrigin TakeOrigin(std::vector<std::string>& comments);

}  // namespace anchorsplat
