#pragma once

#include <string>
#include <vector>

#include "scene/asset_source.h"
#include "scene/mesh.h"
#include "scene/mesh_import.h"
#include "scene/raw_scene.h"

namespace anchorsplat {

// Fills `mesh.materials` and `mesh.textures` from what the file says (mesh_import.h says what becomes of colours).
// `ending` is the file's, in small letters with its dot. Pictures that are missing or cannot be decoded are warnings
// that name the material and the picture; the material keeps its colour.
void LoadMaterials(const RawScene& scene, const AssetSource& source, const std::string& ending,
                   const MeshLimits& limits, Mesh& mesh, std::vector<std::string>& warnings);

}  // namespace anchorsplat
