#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"
#include "scene/vertex_unifier.h"

namespace anchorsplat {

// A mesh file as parsed by assimp, before its pictures are read. Passed from the reading process to ours
// (assimp_import.h).
struct RawMaterial {
  std::string name;
  bool has_color = false;
  std::array<float, 3> color{};  // 0–1, sRGB
  float opacity = 1;
  bool two_sided = true;
  bool opaque = false;  // ignores the picture's alpha
  std::string picture;  // colour picture; "": none
  std::string mask;     // separate opacity picture; "": none
};

struct EmbeddedPicture {
  std::string name;  // an alternative to "*0", "*1" … by index
  uint32_t width = 0;
  uint32_t height = 0;  // 0: `bytes` is an encoded file
  std::string bytes;    // otherwise [H,W,4] rgba
};

struct RawScene {
  MeshCorners corners;                 // finite, no triangle without area; zero normals if the file has none
  std::vector<RawMaterial> materials;  // at least one
  std::vector<EmbeddedPicture> pictures;
  int64_t degenerate = 0;
  int64_t not_finite = 0;
  int64_t not_triangles = 0;
  bool has_normals = false;
};

std::string Pack(const RawScene& scene);

// Validates everything, as the packing process may have been corrupted by its file. kBadFile: not made by Pack, or a
// violation of the invariants above.
Result<RawScene> Unpack(std::string_view bytes);

}  // namespace anchorsplat
