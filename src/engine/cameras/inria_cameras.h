#pragma once

#include <filesystem>

#include "core/camera.h"
#include "core/result.h"
#include "io/json_file.h"

namespace anchorsplat {

// Cameras of a parsed INRIA cameras.json: an array of {img_name, width, height, position, rotation, fx, fy}, with the
// camera centre as `position` and the camera-to-world matrix in OpenCV axes as `rotation`. The principal point is the
// image centre. Images are searched in `folder` and its `images`.
Result<CameraSet> CamerasFromInria(const JsonValue& root, const std::filesystem::path& folder);

}  // namespace anchorsplat
