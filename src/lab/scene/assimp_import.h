#pragma once

#include <string>

#include "scene/assimp_files.h"
#include "scene/mesh_import.h"
#include "scene/raw_scene.h"

namespace anchorsplat {

// Reads the mesh file `name` by assimp, cut into triangles and with its tree of nodes flattened. `ending` is the
// file's, in small letters with its dot. To be called in a process that may crash (isolated_process.h): assimp does, on
// damaged files. Throws std::runtime_error with a sentence without a beginning when assimp refuses the file, it goes
// over the limits or has no triangle; also whatever assimp throws.
RawScene ImportWithAssimp(const AssimpFileReader& read, const std::string& name, const std::string& ending,
                          const MeshLimits& limits);

}  // namespace anchorsplat
