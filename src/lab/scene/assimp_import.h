#pragma once

#include <string>

#include "scene/assimp_files.h"
#include "scene/mesh_import.h"
#include "scene/raw_scene.h"

namespace anchorsplat {

// Reads the mesh file `name` by assimp, triangulated, with its node tree flattened. `ending`: lower-case extension with
// dot. Call it in a process that may crash (isolated_process.h): assimp crashes on damaged files. Throws
// std::runtime_error (a sentence without its beginning) if assimp rejects the file, a limit is exceeded, or there is no
// triangle; also whatever assimp throws.
RawScene ImportWithAssimp(const AssimpFileReader& read, const std::string& name, const std::string& ending,
                          const MeshLimits& limits);

}  // namespace anchorsplat
