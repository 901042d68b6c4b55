#pragma once

#include <string>
#include <vector>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"

namespace anchorsplat {

// What a run that goes on from a checkpoint must have in common with the one that wrote it, besides its options: each
// as a Fingerprint (core/fingerprint.h), 16 hexadecimal digits.

// All values of all Gaussians.
std::string FingerprintOf(const GaussianCloud& cloud);

// Poses and intrinsics in their order, and the scale of the scene, on which cameras that are held out have a part.
std::string FingerprintOf(const std::vector<Camera>& cameras, double scene_scale);

// The bytes of the cameras' pictures, in the order of the cameras: files of the same name may show something else.
// Errors: those of MappedFile.
Result<std::string> FingerprintOfPictures(const std::vector<Camera>& cameras);

}  // namespace anchorsplat
