#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/camera.h"
#include "core/result.h"

namespace anchorsplat {

// Whether a file with these first bytes is a Bundler reconstruction.
bool LooksLikeBundler(std::string_view head);

// Reads cameras of a Bundler reconstruction (Snavely 2006; also exported by RealityCapture, COLMAP and others),
// bundle.out of version 0.3 or 0.4: focal length, k1, k2, and world-to-camera axes with x right, y up, z backward.
// Cameras with focal length 0 are not registered; a message counts them.
//
// Names come from an image list: for bundle.out list.txt, for SCAN.bundle.out SCAN.list.txt, for SCAN.out
// SCAN.list.txt, SCAN-list.txt or SCAN.txt, else list.txt; in the file's folder, else in its parent. Image sizes come
// from the images, searched below the list's folder, in its `images` and in `images` beside it. Cameras without an
// image are dropped with a warning.
//
// Errors: kNotFound: no list, or none of the images exists; kBadFile with the line.
Result<CameraSet> CamerasFromBundler(const std::filesystem::path& file, std::string_view bytes);

}  // namespace anchorsplat
