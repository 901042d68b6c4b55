#pragma once

#include <array>
#include <cstdint>

#include "scene/mesh.h"

namespace anchorsplat {

// Statistics of a mesh, counting only what is visible (DropInvisibleTriangles).
struct MeshSummary {
  int64_t triangles = 0;
  int64_t vertices = 0;                // used by those triangles
  int64_t materials = 0;               // likewise
  int64_t textures = 0;                // likewise
  int64_t colors = 0;                  // distinct material and vertex colours at 8 bits, of surfaces without texture
  std::array<float, 3> low{}, high{};  // bounding box

  // Shape descriptor independent of position, size and orientation, and nearly of triangulation: the D2 distribution of
  // Osada et al. (2002). Histogram of the distances between 16,384 pairs of random surface points over their mean, 32
  // bins up to three times the mean; sums to 1. In practice, models whose histograms differ by less than about 0.05 in
  // total have the same shape.
  std::array<float, 32> shape{};
};

MeshSummary Summarize(Mesh mesh);

}  // namespace anchorsplat
