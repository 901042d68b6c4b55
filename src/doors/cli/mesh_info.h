#pragma once

#include <string>

#include "cli/verb.h"
#include "core/result.h"

namespace anchorsplat {

// Whether `info` should look at this as a mesh or a furniture library: by its name, and by content where splats have
// files of the same ending (PLY with faces; glTF without Gaussians).
bool LooksLikeMesh(const std::string& address);

// `info` of a mesh, or of every object of a library.
Status RunMeshInfo(const std::string& address, const SharedFlags& shared);

}  // namespace anchorsplat
