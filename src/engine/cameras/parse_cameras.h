#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/camera.h"
#include "core/result.h"

namespace anchorsplat {

// ReadCameras (cameras/camera_io.h) for a file in memory; `name` is used in messages. Images are searched from `folder`
// on, and opened only if the cameras do not give their size. Not for COLMAP models, which are folders; a Bundler file
// needs a list beside it. Errors: kBadFile; kNotFound for that list.
Result<CameraSet> ParseCameras(const std::string& name, std::string_view bytes,
                               const std::filesystem::path& folder = {});

}  // namespace anchorsplat
