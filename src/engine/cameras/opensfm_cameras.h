#pragma once

#include <filesystem>

#include "core/camera.h"
#include "core/result.h"
#include "io/json_file.h"

namespace anchorsplat {

// Whether it is a reconstruction.json: a list of objects with "shots".
bool IsOpenSfm(const JsonValue& root);

// Reads cameras of an OpenSfM reconstruction.json (in OpenDroneMap's folder `opensfm`): shots sorted by name, which is
// the image name; images are searched in `images` of `folder`, in `folder` and in `images` beside it. Rotations are
// axis times angle, world to camera. Focal lengths and principal points are in units of the longer side, the latter
// from the image centre. The world is the file's own, in metres from `reference_lla`, if given, which is only reported.
// Of several reconstructions the one with the most shots is taken; a message describes the others.
//
// Lenses: perspective, simple_radial, radial, brown, fisheye, fisheye_opencv. Errors (kBadFile with the JSON path):
// another lens, by name; a camera without width and height; a missing or invalid value.
Result<CameraSet> CamerasFromOpenSfm(const JsonValue& root, const std::filesystem::path& folder);

}  // namespace anchorsplat
