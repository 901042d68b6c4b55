#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace anchorsplat {

// Normals for triangles that come without: at each corner the mean of the normals of all triangles that meet there and
// whose own normal differs by at most `angle_degrees`, weighted by their angle at the corner, which does not depend on
// how a flat face was cut into triangles (Thürmer and Wüthrich 1998). Corners meet when their positions are equal, so
// that seams of texture coordinates and materials do not show. Where more than 512 triangles meet, facet normals are
// given instead: nothing real does that, and a hostile file would make the work quadratic.
//
// `corners` [3T]: finite positions, three for each triangle. `normals` [3T]: those of length zero are filled, others
// stay. Triangles without area keep zero normals unless neighbours lend them theirs.
void FillSmoothNormals(std::span<const std::array<float, 3>> corners, float angle_degrees,
                       std::vector<std::array<float, 3>>& normals);

}  // namespace anchorsplat
