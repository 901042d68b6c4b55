#pragma once

#include <cstdint>

#include "core/result.h"
#include "scene/mesh.h"

namespace anchorsplat {

// Puts a mesh into a room: the inside of a cube around the origin whose half side is `half_side` (world units), six
// walls with a picture each of details of every size: patches of colour, tiles, posters. So every pixel of every view
// shows some surface, as in captures of real places. Pictures are made by `seed`, the same on every machine.
//
// What the mesh had keeps its place in all arrays; uvs, normals and colours are filled up where only one side has them.
// kBadArgument: an invalid mesh, a half side that is not positive, or the mesh reaches out of the room.
Status AddBackdrop(Mesh& mesh, double half_side, uint64_t seed);

inline constexpr double kBackdropShare = 1.25;  // half side of the room, of the distance of the cameras
inline constexpr int kBackdropPixels = 1024;    // of a wall's picture, a side

}  // namespace anchorsplat
