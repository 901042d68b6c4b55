#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "scene/mesh.h"

namespace anchorsplat {

// A mesh without shared vertices, three corners per triangle. Vectors have 3T elements, materials T; uvs and colors are
// empty if the mesh has none.
struct MeshCorners {
  std::vector<std::array<float, 3>> positions;
  std::vector<std::array<float, 3>> normals;
  std::vector<std::array<float, 2>> uvs;
  std::vector<std::array<float, 4>> colors;
  std::vector<int32_t> materials;
  bool has_uvs = false;
  bool has_colors = false;
};

// Merges corners that are equal in every bit into vertices. Triangles keep their order; vertices are in order of their
// first corner. Materials and textures stay empty.
Mesh UnifyVertices(const MeshCorners& corners);

// Drops materials without triangles and textures without materials; keeps the others' order.
void RemoveUnusedMaterials(Mesh& mesh);

}  // namespace anchorsplat
