#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/result.h"
#include "scene/mesh.h"

namespace anchorsplat {

// Daylight in a closed room, computed once and baked into vertex colours, so that all views agree and need no shadows.
// With n the surface normal and A the light from the window,
//
//   light = min(1, 0.3 + 0.3·open + 0.5·A / (A + 0.1))
//
// `open`: cosine-weighted share of directions without an obstacle within `reach`, so corners and what is under
// furniture are darker. A = area/N · Σ cos·cos′/r² over the visible ones of N points of the window.
struct DaylightOptions {
  // The window: a parallelogram whose normal right × up points into the room.
  std::array<float, 3> corner = {0, 0, 0};
  std::array<float, 3> right = {1, 0, 0};
  std::array<float, 3> up = {0, 1, 0};
  // The room's interior. Surfaces are lit on the side inside it; backs of walls do not count.
  std::array<float, 3> low = {0, 0, 0};
  std::array<float, 3> high = {1, 1, 1};
  float reach = 0.8f;
  float longest_edge = 0.06f;  // light is interpolated linearly over at most this distance
};

// Subdivides triangles until no edge is longer than `longest_edge`, except in materials that are already `lit`. Edges
// are halved by a rule that depends on the edge alone, so neighbours stay connected. Normals, texture coordinates and
// colours are interpolated. kBadArgument: an invalid mesh; an edge that is not positive; more than 2²⁵ triangles.
Status CutToEdges(Mesh& mesh, float longest_edge);

// Subdivides and lights the mesh: multiplies vertex colours (white if absent) and marks all materials `lit`. What was
// lit before, such as the sky behind the window, stays. The same bits for any number of threads. Errors: those of
// CutToEdges and RayTracer::Create.
Status BakeDaylight(Mesh& mesh, const DaylightOptions& options);

}  // namespace anchorsplat
