#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "core/camera.h"
#include "core/result.h"

namespace anchorsplat {

// Reads LLFF's poses_bounds.npy (Mildenhall et al. 2019, https://github.com/Fyusion/LLFF): 17 numbers per view, a
// row-major 3×5 matrix and the nearest and farthest depth. The matrix is camera-to-world with columns down, right,
// back, centre, and (height, width, focal length) in pixels; the principal point is the centre. The lens is not
// recorded.
//
// Image names are not recorded either: images are those of `images` beside it, or of the first of images_2, images_4,
// images_8, sorted by name, and their number must match. Without such a folder, views are named 000, 001 …
//
// Errors: kNotFound, kIo; kBadFile with the byte or view: not an N × 17 array of floats or doubles, too few bytes, a
// pose that is not a rotation, another number of images.
Result<CameraSet> ReadPosesBounds(const std::filesystem::path& path);

// The same for bytes in memory; `name` is used in messages, `pictures` are the view's images.
Result<CameraSet> ParsePosesBounds(const std::string& name, std::string_view bytes,
                                   std::span<const std::filesystem::path> pictures);

}  // namespace anchorsplat
