#pragma once

#include <string>
#include <vector>

#include "scene/asset_source.h"
#include "scene/mesh.h"
#include "scene/mesh_import.h"
#include "scene/raw_scene.h"

namespace anchorsplat {

// Fills `mesh.materials` and `mesh.textures` (mesh_import.h explains colours). `ending`: lower-case extension with dot.
// For pictures missing or undecodable, adds warnings that name material and picture; the material keeps its colour.
void LoadMaterials(const RawScene& scene, const AssetSource& source, const std::string& ending,
                   const MeshLimits& limits, Mesh& mesh, std::vector<std::string>& warnings);

}  // namespace anchorsplat
