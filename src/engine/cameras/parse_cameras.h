#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/camera.h"
#include "core/result.h"

namespace anchorsplat {

// ReadCameras (cameras/camera_io.h) of a file whose bytes are in memory; `name` is what messages call them. Pictures
// are looked for from `folder` on, and opened only where the cameras do not say their size. COLMAP's models are folders
// and have no bytes; a Bundler file has a list beside it. Errors: kBadFile; kNotFound for that list.
Result<CameraSet> ParseCameras(const std::string& name, std::string_view bytes,
                               const std::filesystem::path& folder = {});

}  // namespace anchorsplat
