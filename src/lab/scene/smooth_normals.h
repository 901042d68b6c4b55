#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace anchorsplat {

// Computes missing normals: at each corner the mean of the normals of all triangles that meet there and differ by at
// most `angle_degrees`, weighted by their angle at the corner, which makes the result independent of how flat faces
// were triangulated (Thürmer and Wüthrich 1998). Corners meet if their positions are equal, so that seams of texture
// coordinates and materials do not show. If more than 512 triangles meet, facet normals are used: real meshes never
// have that, and hostile files would make the work quadratic.
//
// `corners` [3T]: finite positions, three per triangle. `normals` [3T]: fills those of length zero. Triangles without
// area keep zero normals unless neighbours provide some.
void FillSmoothNormals(std::span<const std::array<float, 3>> corners, float angle_degrees,
                       std::vector<std::array<float, 3>>& normals);

}  // namespace anchorsplat
