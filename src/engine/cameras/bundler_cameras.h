#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/camera.h"
#include "core/result.h"

namespace anchorsplat {

// Whether these first bytes of a file are those of a Bundler reconstruction.
bool LooksLikeBundler(std::string_view head);

// Cameras of a Bundler reconstruction (Snavely 2006; RealityCapture, COLMAP and others export it, too), bundle.out of
// version 0.3 or 0.4: focal length, k1, k2, and world-to-camera axes of which x points right, y up and z backward.
// Cameras with focal length 0 are not registered; a message counts them.
//
// Names are the lines of the list of pictures: for bundle.out list.txt, for SCAN.bundle.out SCAN.list.txt, for SCAN.out
// SCAN.list.txt, SCAN-list.txt or SCAN.txt, else list.txt; beside the file, else in the folder above. The file says no
// sizes: they are the pictures', which are looked for below the list's folder, in its `images` and in `images` beside
// it. Cameras without a picture are left out with a warning.
//
// Errors: kNotFound without a list, or where none of the pictures is found; kBadFile with the line.
Result<CameraSet> CamerasFromBundler(const std::filesystem::path& file, std::string_view bytes);

}  // namespace anchorsplat
