#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/result.h"

namespace anchorsplat {

// A picture on a surface: 8-bit sRGB values as stored in the file, rows from top to bottom.
struct Texture {
  std::string name;
  int width = 0;
  int height = 0;
  bool has_alpha = false;     // some texel has alpha < 255: the surface is tested against ½ and may have holes
  std::vector<uint8_t> rgba;  // [H,W,4]
};

struct Material {
  std::string name;
  std::array<float, 3> diffuse = {0.7f, 0.7f, 0.7f};  // 0–1, in the space of the texture's values; used without texture
  float opacity = 1;                                  // 0 invisible … 1 solid
  int texture = -1;                                   // index into Mesh::textures, −1: none
  bool two_sided = true;                              // as the file says; every surface is shaded towards the viewer
  bool lit = false;  // colours have the light in them (baked_light.h): it is shown as it is, without lamps
};

// Triangles with unified vertices: one index per corner for position, normal, texture coordinate and colour. y is up.
struct Mesh {
  std::vector<std::array<float, 3>> positions;     // [V]
  std::vector<std::array<float, 3>> normals;       // [V] or empty; of any length, zero = none (flat shading)
  std::vector<std::array<float, 2>> uvs;           // [V] or empty; (0,0) is the texture's lower left corner, repeats
  std::vector<std::array<float, 4>> colors;        // [V] or empty; rgba 0–1, multiplies the material's colour
  std::vector<std::array<uint32_t, 3>> triangles;  // [T] vertex indices
  std::vector<int32_t> triangle_materials;         // [T] index into materials
  std::vector<Material> materials;
  std::vector<Texture> textures;
};

// Sizes agree and every index points at something; values may be anything. kBadArgument otherwise.
Status Validate(const Mesh& mesh);

// Removes what cannot be seen: triangles whose material is more transparent than 0.3, triangles with a corner that is
// not finite, and triangles without area. Vertices stay. Counts are returned.
struct DroppedTriangles {
  int64_t transparent = 0;
  int64_t not_finite = 0;
  int64_t degenerate = 0;
};
inline constexpr float kMinVisibleOpacity = 0.3f;
DroppedTriangles DropInvisibleTriangles(Mesh& mesh);

// The mesh moved and scaled so that the centre of the box of its *used* vertices is the origin and the box's longest
// side is 1. kBadArgument: no triangle, or a box without extent.
Result<Mesh> NormalizedToUnitCube(Mesh mesh);

}  // namespace anchorsplat
