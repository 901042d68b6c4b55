#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/result.h"

namespace anchorsplat {

// A surface texture: 8-bit sRGB values as stored, rows from top to bottom.
struct Texture {
  std::string name;
  int width = 0;
  int height = 0;
  bool has_alpha = false;     // some texel has alpha < 255: alpha is tested against ½, so the surface may have holes
  std::vector<uint8_t> rgba;  // [H,W,4]
};

struct Material {
  std::string name;
  std::array<float, 3> diffuse = {0.7f, 0.7f, 0.7f};  // 0–1, in the texture's colour space; ignored with a texture
  float opacity = 1;                                  // 0 invisible … 1 solid
  int texture = -1;                                   // index into Mesh::textures, −1: none
  bool two_sided = true;                              // from the file; shading always faces the viewer
  bool lit = false;                                   // colours include light (baked_light.h): shown without lamps
};

// Indexed triangles: one vertex index per corner for position, normal, texture coordinate and colour. y is up.
struct Mesh {
  std::vector<std::array<float, 3>> positions;     // [V]
  std::vector<std::array<float, 3>> normals;       // [V] or empty; any length, zero = none (flat shading)
  std::vector<std::array<float, 2>> uvs;           // [V] or empty; (0,0) is the texture's lower left corner; repeats
  std::vector<std::array<float, 4>> colors;        // [V] or empty; rgba 0–1, multiplied with the material's colour
  std::vector<std::array<uint32_t, 3>> triangles;  // [T] vertex indices
  std::vector<int32_t> triangle_materials;         // [T] index into materials
  std::vector<Material> materials;
  std::vector<Texture> textures;
};

// Checks array sizes and indices, not values. kBadArgument otherwise.
Status Validate(const Mesh& mesh);

// Removes invisible triangles: of materials with opacity below 0.3, with non-finite corners, or without area. Keeps
// vertices. Returns counts.
struct DroppedTriangles {
  int64_t transparent = 0;
  int64_t not_finite = 0;
  int64_t degenerate = 0;
};
inline constexpr float kMinVisibleOpacity = 0.3f;
DroppedTriangles DropInvisibleTriangles(Mesh& mesh);

// Moves and scales the mesh so that the bounding box of its *used* vertices is centred at the origin with longest side
// 1.
// kBadArgument: no triangle, or a box without extent.
Result<Mesh> NormalizedToUnitCube(Mesh mesh);

}  // namespace anchorsplat
