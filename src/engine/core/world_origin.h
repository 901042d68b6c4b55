#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace anchorsplat {

// Origin of a splat's means: world position (double) = origin + mean (float). It is zero unless coordinates are so
// large compared to the splat's detail, as in maps, that floats would be too coarse. Cameras, regions and all user
// input are in world coordinates.
using WorldOrigin = std::array<double, 3>;  // world units

inline bool IsZero(const WorldOrigin& origin) { return origin[0] == 0 && origin[1] == 0 && origin[2] == 0; }

// Conversions between world coordinates and coordinates relative to the origin.
std::array<double, 3> RelativeToOrigin(const std::array<double, 3>& point, const WorldOrigin& origin);
std::array<double, 3> ToWorld(const float* mean, const WorldOrigin& origin);

// Chooses an origin, in round numbers near the middle of `points` ([M,3], world units), for a smallest relevant size of
// `detail`. Zero if floats suffice there: their spacing is below detail / 256. Points that are not finite are ignored.
WorldOrigin ChooseOrigin(std::span<const double> points, double detail);
// The same with detail = median distance from the middle / 128, for camera centres. Zero for fewer than two points.
WorldOrigin ChooseOrigin(std::span<const double> points);

// Origin as text, "500000 4500000 120", in the fewest digits that read back the same. The inverse accepts only three
// finite numbers up to 1e15, beyond which doubles are too coarse as well.
std::string TextOf(const WorldOrigin& origin);
std::optional<WorldOrigin> OriginOf(std::string_view text);

// The comment that records an origin in our files, and its inverse; none for other or malformed comments.
std::string OriginComment(const WorldOrigin& origin);
std::optional<WorldOrigin> OriginOfComment(std::string_view comment);
bool IsOriginComment(std::string_view comment);  // malformed or not
// Removes origin comments and returns the last origin; zero if there is none.
WorldOrigin TakeOrigin(std::vector<std::string>& comments);

}  // namespace anchorsplat
