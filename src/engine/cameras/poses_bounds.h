#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "core/camera.h"
#include "core/result.h"

namespace anchorsplat {

// LLFF's poses_bounds.npy (Mildenhall et al. 2019, https://github.com/Fyusion/LLFF): per view 17 numbers, a 3×5 matrix
// row by row and the nearest and farthest depth. The matrix is camera-to-world with the columns down, right, back,
// centre, and (height, width, focal length) in pixels; the principal point is the middle. What lens there was it does
// not say.
//
// Nor does it name the pictures: they are those of `images` beside it, or of the first of images_2, images_4, images_8,
// in the order of their names, and must be as many. Without such a folder views are called 000, 001 …
//
// Errors: kNotFound, kIo; kBadFile with the byte or the view: no array of N × 17 floats or doubles, fewer bytes than it
// says, poses that are no rotations, another number of pictures.
Result<CameraSet> ReadPosesBounds(const std::filesystem::path& path);

// The same of bytes that are in memory; `name` is what messages call them, `pictures` are those of the views.
Result<CameraSet> ParsePosesBounds(const std::string& name, std::string_view bytes,
                                   std::span<const std::filesystem::path> pictures);

}  // namespace anchorsplat
