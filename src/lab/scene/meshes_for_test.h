#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "core/random.h"
#include "scene/mesh.h"

namespace anchorsplat {

// Small meshes with known pictures.

// Adds a parallelogram from `corner` along `right` and `up` with texture coordinates 0–1.
inline void AddQuad(Mesh& mesh, const std::array<float, 3>& corner, const std::array<float, 3>& right,
                    const std::array<float, 3>& up, int32_t material) {
  const uint32_t first = static_cast<uint32_t>(mesh.positions.size());
  for (const auto& [s, t] : {std::array<float, 2>{0, 0}, {1, 0}, {1, 1}, {0, 1}}) {
    mesh.positions.push_back({corner[0] + s * right[0] + t * up[0], corner[1] + s * right[1] + t * up[1],
                              corner[2] + s * right[2] + t * up[2]});
    mesh.uvs.push_back({s, t});
  }
  mesh.triangles.push_back({first, first + 1, first + 2});
  mesh.triangles.push_back({first, first + 2, first + 3});
  mesh.triangle_materials.insert(mesh.triangle_materials.end(), {material, material});
}

// A unit square in the plane z = `z`, facing +z, of one colour.
inline Mesh SquareAt(float z, const std::array<float, 3>& color) {
  Mesh mesh;
  Material material;
  material.diffuse = color;
  mesh.materials = {material};
  AddQuad(mesh, {-0.5f, -0.5f, z}, {1, 0, 0}, {0, 1, 0}, 0);
  return mesh;
}

// A sphere around the origin, flat-shaded unless `smooth`.
inline Mesh SphereMesh(float radius, int rings, bool smooth) {
  Mesh mesh;
  mesh.materials.resize(1);
  const int sectors = 2 * rings;
  for (int r = 0; r <= rings; ++r) {
    for (int s = 0; s <= sectors; ++s) {
      const double theta = std::numbers::pi * r / rings, phi = 2 * std::numbers::pi * s / sectors;
      const std::array<float, 3> n = {static_cast<float>(std::sin(theta) * std::cos(phi)),
                                      static_cast<float>(std::cos(theta)),
                                      static_cast<float>(std::sin(theta) * std::sin(phi))};
      mesh.positions.push_back({radius * n[0], radius * n[1], radius * n[2]});
      if (smooth) mesh.normals.push_back(n);
    }
  }
  for (int r = 0; r < rings; ++r) {
    for (int s = 0; s < sectors; ++s) {
      const uint32_t a = static_cast<uint32_t>(r * (sectors + 1) + s), b = a + static_cast<uint32_t>(sectors) + 1;
      if (r > 0) mesh.triangles.push_back({a, a + 1, b});
      if (r + 1 < rings) mesh.triangles.push_back({a + 1, b + 1, b});
    }
  }
  mesh.triangle_materials.assign(mesh.triangles.size(), 0);
  return mesh;
}

// Random triangles in the unit cube, each with its own colour.
inline Mesh RandomTriangles(int count, uint64_t seed) {
  Random random(seed);
  Mesh mesh;
  for (int t = 0; t < count; ++t) {
    Material material;
    for (float& x : material.diffuse) x = static_cast<float>(random.Uniform());
    mesh.materials.push_back(material);
    std::array<double, 3> center;
    for (double& x : center) x = random.Uniform(-0.4, 0.4);
    for (int k = 0; k < 3; ++k) {
      std::array<float, 3> p;
      for (size_t i = 0; i < 3; ++i) p[i] = static_cast<float>(center[i] + random.Uniform(-0.2, 0.2));
      mesh.positions.push_back(p);
    }
    const uint32_t first = static_cast<uint32_t>(3 * t);
    mesh.triangles.push_back({first, first + 1, first + 2});
    mesh.triangle_materials.push_back(t);
  }
  return mesh;
}

}  // namespace anchorsplat
