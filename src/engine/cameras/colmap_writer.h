#pragma once

#include <filesystem>
#include <span>

#include "cameras/colmap_model.h"
#include "core/camera.h"
#include "core/result.h"
#include "io/write_options.h"

namespace anchorsplat {

enum class ColmapForm { kBinary, kText };

// Writes cameras.bin and images.bin (or .txt) into `folder`, which must exist. Cameras with the same intrinsics share
// one entry; all are of model PINHOLE. Ids count from 1 in the order of `cameras`; an image's name is the camera's with
// its picture's extension (.png where it has none). ReadColmapModel gives back the same numbers: text has all digits.
//
// Errors: kExists, kNotFound, kIo; kBadArgument: no cameras, a name that is empty or has a line break or zero byte,
// numbers that are not finite.
Status WriteColmapCameras(const std::filesystem::path& folder, const CameraSet& cameras, ColmapForm form,
                          const WriteOptions& options = {});

// points3D.bin or .txt. kBadArgument: a position that is not finite.
Status WriteColmapPoints(const std::filesystem::path& folder, std::span<const ColmapPoint> points, ColmapForm form,
                         const WriteOptions& options = {});

}  // namespace anchorsplat
