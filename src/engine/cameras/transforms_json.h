#pragma once

#include <filesystem>

#include "core/camera.h"
#include "core/result.h"
#include "io/json_file.h"

namespace anchorsplat {

// Cameras of a NeRF transforms.json that is already parsed: `frames` with `file_path` and `transform_matrix`
// (camera-to-world, OpenGL axes, 4x4 or 3x4), intrinsics by `camera_angle_x` or `fl_x`, `fl_y`, `cx`, `cy`, `w`, `h`
// for all frames or per frame (the frame's own win), the lens by nerfstudio's `camera_model`, k1 … k4, p1, p2 or
// `distortion_params`, `mask_path`, `ply_file_path`, optionally our `background` (rgb 0–1) and `camera_axes` ("opencv"
// where the matrices are in these). Without `w` and `h` the size is that of the picture. `folder` is the one the paths
// are relative to, and below which pictures are searched (cameras/picture_search.h); `complete`: the file is no part of
// a set, and pictures that it does not name are worth a word. Where a picture is missing, `image` is where it was
// looked for.
Result<CameraSet> CamerasFromTransforms(const JsonValue& root, const std::filesystem::path& folder, bool complete);

}  // namespace anchorsplat
