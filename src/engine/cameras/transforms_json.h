#pragma once

#include <filesystem>

#include "core/camera.h"
#include "core/result.h"
#include "io/json_file.h"

namespace anchorsplat {

// Cameras of a parsed NeRF transforms.json. Reads `frames` with `file_path` and `transform_matrix` (camera-to-world,
// OpenGL axes, 4x4 or 3x4); intrinsics by `camera_angle_x` or `fl_x`, `fl_y`, `cx`, `cy`, `w`, `h`, global or per frame
// (which takes precedence); the lens by nerfstudio's `camera_model`, k1 … k4, p1, p2 or `distortion_params`;
// `mask_path`, `ply_file_path`; and our optional `background` (rgb 0–1) and `camera_axes` ("opencv" for matrices in
// OpenCV axes). Without `w` and `h` the image's size is used.
//
// Paths are relative to `folder`, below which images are searched (cameras/picture_search.h). `complete`: the file is
// not part of a set, so images that it does not name are reported. A missing image leaves the path tried in `image`.
Result<CameraSet> CamerasFromTransforms(const JsonValue& root, const std::filesystem::path& folder, bool complete);

}  // namespace anchorsplat
