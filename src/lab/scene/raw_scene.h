#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"
#include "scene/vertex_unifier.h"

namespace anchorsplat {

// A mesh file as assimp understood it, before its pictures are read: what passes from the process that reads the file
// to ours (assimp_import.h).
struct RawMaterial {
  std::string name;
  bool has_color = false;
  std::array<float, 3> color{};  // 0–1, sRGB
  float opacity = 1;
  bool two_sided = true;
  bool opaque = false;  // whatever the picture's alpha says
  std::string picture;  // the colour picture; "" none
  std::string mask;     // a separate picture of the opacity; "" none
};

struct EmbeddedPicture {
  std::string name;  // besides "*0", "*1" … by position
  uint32_t width = 0;
  uint32_t height = 0;  // 0: `bytes` is a file
  std::string bytes;    // else [H,W,4] rgba
};

struct RawScene {
  MeshCorners corners;                 // finite; no triangle without area; zero normals where the file gives none
  std::vector<RawMaterial> materials;  // at least one
  std::vector<EmbeddedPicture> pictures;
  int64_t degenerate = 0;
  int64_t not_finite = 0;
  int64_t not_triangles = 0;
  bool has_normals = false;
};

std::string Pack(const RawScene& scene);

// Trusts nothing, as the packing process may have been damaged by the file it read. kBadFile: not what Pack makes, or
// a scene that breaks a promise above.
Result<RawScene> Unpack(std::string_view bytes);

}  // namespace anchorsplat
