#pragma once

#include <assimp/scene.h>

#include <array>
#include <string>
#include <vector>

#include "scene/asset_source.h"
#include "scene/mesh.h"
#include "scene/mesh_import.h"

namespace anchorsplat {

// The materials of an assimp scene, with their pictures decoded (mesh_import.h says what becomes of colours).
struct ImportedMaterials {
  std::vector<Material> list;        // at least one; index as in the scene
  std::vector<unsigned> uv_channel;  // for each material, which texture coordinates its picture takes
  std::vector<Texture> textures;
  bool linear = false;  // the file's factors and vertex colours are linear (glTF)

  // A vertex colour as this project keeps colours; what is not finite becomes 1.
  std::array<float, 4> ToSrgb(const aiColor4D& color) const;
};

// `ending` is the file's, in small letters with its dot. Pictures that are missing or cannot be decoded are warnings
// that name the material and the picture; the material keeps its colour.
ImportedMaterials ImportMaterials(const aiScene& scene, const AssetSource& source, const std::string& ending,
                                  const MeshLimits& limits, std::vector<std::string>& warnings);

}  // namespace anchorsplat
