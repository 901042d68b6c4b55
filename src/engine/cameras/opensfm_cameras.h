#pragma once

#include <filesystem>

#include "core/camera.h"
#include "core/result.h"
#include "io/json_file.h"

namespace anchorsplat {

// Whether it is a reconstruction.json: a list of objects with "shots".
bool IsOpenSfm(const JsonValue& root);

// Cameras of an OpenSfM reconstruction.json, as OpenDroneMap has it in its folder `opensfm`: shots sorted by name,
// which is their picture's; pictures are looked for in `images` of `folder`, in `folder` and in `images` beside it.
// Rotations are axis times angle, world to camera; focal lengths and principal points are in the longer side, the
// latter from the picture's middle. The world is the file's own, metres from `reference_lla` where it has one, which is
// only said. Of several reconstructions the one with the most shots is taken; a message says what the others have.
//
// Lenses: perspective, simple_radial, radial, brown, fisheye, fisheye_opencv. Errors (kBadFile with the JSON path):
// other ones by name; a camera without width and height; what is missing or no number.
Result<CameraSet> CamerasFromOpenSfm(const JsonValue& root, const std::filesystem::path& folder);

}  // namespace anchorsplat
