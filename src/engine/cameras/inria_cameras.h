#pragma once

#include <filesystem>

#include "core/camera.h"
#include "core/result.h"
#include "io/json_file.h"

namespace anchorsplat {

// Cameras of an INRIA cameras.json that is already parsed: an array of {img_name, width, height, position, rotation,
// fx, fy}, where `position` is the camera's centre and `rotation` its camera-to-world matrix in OpenCV axes. The
// principal point is the picture's centre. Pictures are looked for in `folder` and its `images`.
Result<CameraSet> CamerasFromInria(const JsonValue& root, const std::filesystem::path& folder);

}  // namespace anchorsplat
