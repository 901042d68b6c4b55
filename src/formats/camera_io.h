#pragma once

#include <filesystem>

#include "core/camera.h"
#include "core/result.h"

namespace anchorsplat {

// Reads cameras from a NeRF/nerfstudio transforms.json, an INRIA cameras.json, or a COLMAP sparse model (folder with
// cameras/images .bin or .txt, or a project folder that has it at sparse/0 or sparse). Order as in the file.
// Errors: kNotFound; kBadFile with file, line or byte or JSON path; distortion is refused with the model's name.
Result<CameraSet> ReadCameras(const std::filesystem::path& path);

}  // namespace anchorsplat
