#pragma once

#include <filesystem>
#include <span>

#include "cameras/colmap_model.h"
#include "core/camera.h"
#include "core/result.h"
#include "io/write_options.h"

namespace anchorsplat {

enum class ColmapForm { kBinary, kText };

// Writes cameras.bin and images.bin (or .txt) into an existing `folder`. Cameras with equal intrinsics share an entry;
// all use PINHOLE. Ids count from 1 in the order of `cameras`. Image names are camera names with the image's extension
// (.png without an image). ReadColmapModel gives back the same numbers: text has all digits.
//
// Errors: kExists, kNotFound, kIo; kBadArgument: no cameras, a name that is empty or contains a line break or zero
// byte, a number that is not finite.
Status WriteColmapCameras(const std::filesystem::path& folder, const CameraSet& cameras, ColmapForm form,
                          const WriteOptions& options = {});

// Writes points3D.bin or .txt. kBadArgument: a position that is not finite.
Status WriteColmapPoints(const std::filesystem::path& folder, std::span<const ColmapPoint> points, ColmapForm form,
                         const WriteOptions& options = {});

}  // namespace anchorsplat
