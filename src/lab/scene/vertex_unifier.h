#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "scene/mesh.h"

namespace anchorsplat {

// A mesh corner by corner, three for each triangle, nothing shared. All vectors have 3T elements, materials
// T; uvs and colors are empty where the mesh has none.
struct MeshCorners {
  std::vector<std::array<float, 3>> positions;
  std::vector<std::array<float, 3>> normals;
  std::vector<std::array<float, 2>> uvs;
  std::vector<std::array<float, 4>> colors;
  std::vector<int32_t> materials;
  bool has_uvs = false;
  bool has_colors = false;
};

// The same triangles in the same order, with corners that agree in every bit made one vertex. Vertices are in the order
// of their first corner. Materials and textures stay empty.
Mesh UnifyVertices(const MeshCorners& corners);

// Drops the materials no triangle uses and the textures no material uses, keeping the order of the others.
void RemoveUnusedMaterials(Mesh& mesh);

}  // namespace anchorsplat
