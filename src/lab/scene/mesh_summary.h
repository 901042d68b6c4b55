#pragma once

#include <array>
#include <cstdint>

#include "scene/mesh.h"

namespace anchorsplat {

// What a mesh is made of, in numbers. Only what can be seen counts (DropInvisibleTriangles).
struct MeshSummary {
  int64_t triangles = 0;
  int64_t vertices = 0;   // used by those triangles
  int64_t materials = 0;  // likewise
  int64_t textures = 0;   // likewise
  int64_t colors = 0;     // different material colours and vertex colours at 8 bits, of surfaces without texture
  std::array<float, 3> low{}, high{};  // box

  // A description of the shape that does not depend on position, size or orientation, nor much on how the surface is
  // cut into triangles: the D2 distribution of Osada et al. (2002), distances between 16,384 pairs of random surface
  // points over their mean, as a histogram of 32 bins up to three times the mean; sums to 1. Two models whose
  // histograms differ by less than about 0.05 in all have, in practice, one shape.
  std::array<float, 32> shape{};
};

MeshSummary Summarize(Mesh mesh);

}  // namespace anchorsplat
