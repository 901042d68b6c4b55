#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/result.h"
#include "scene/mesh.h"

namespace anchorsplat {

// Daylight in a closed room, computed once and kept in the colours of the vertices, so that all views agree and none
// pays for shadows. With n the normal of a place and A what the window gives it,
//
//   light = min(1, 0.3 + 0.3·open + 0.5·A / (A + 0.1))
//
// `open` is the cosine-weighted share of directions in which nothing is nearer than `reach`: corners and what is under
// furniture are darker. A = area/N · Σ cos·cos′/r² over N places of the window that are in sight.
struct DaylightOptions {
  // The window, a parallelogram whose cross product right × up points into the room.
  std::array<float, 3> corner = {0, 0, 0};
  std::array<float, 3> right = {1, 0, 0};
  std::array<float, 3> up = {0, 1, 0};
  // The room's inside. A surface is lit on the side that lies in it: what the backs of walls would see does not count.
  std::array<float, 3> low = {0, 0, 0};
  std::array<float, 3> high = {1, 1, 1};
  float reach = 0.8f;
  float longest_edge = 0.06f;  // light is linear between places that are no farther apart
};

// Cuts triangles until no edge is longer than `longest_edge`, except those of materials that are `lit` already: at the
// middles of edges, by the edge alone, so that neighbours stay neighbours. Normals, texture coordinates and colours are
// those between the corners. kBadArgument: an invalid mesh, an edge that is not positive, or more than 2²⁵ triangles.
Status CutToEdges(Mesh& mesh, float longest_edge);

// Cuts the mesh and lights it: multiplies vertex colours (white where there are none) and marks all materials as `lit`.
// What was lit before, such as the sky behind the window, stays as it is. The same bits for any number of threads.
// Errors as CutToEdges and RayTracer::Create.
Status BakeDaylight(Mesh& mesh, const DaylightOptions& options);

}  // namespace anchorsplat
