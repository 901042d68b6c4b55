#pragma once

#include <cstdint>

#include "core/result.h"
#include "scene/mesh.h"

namespace anchorsplat {

// Encloses a mesh in a room: the inside of a cube around the origin with half side `half_side` (world units). Each wall
// has a picture with details of every size: patches of colour, tiles, posters. So every pixel of every view shows a
// surface, as in captures of real places. Pictures depend on `seed` only.
//
// The mesh's elements keep their indices; uvs, normals and colours are padded if only one side has them. kBadArgument:
// an invalid mesh; a half side that is not positive; a mesh that extends beyond the room.
Status AddBackdrop(Mesh& mesh, double half_side, uint64_t seed);

inline constexpr double kBackdropShare = 1.25;  // half side of the room relative to the cameras' distance
inline constexpr int kBackdropPixels = 1024;    // side of a wall's picture

}  // namespace anchorsplat
