#pragma once

#include <string>
#include <vector>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"

namespace anchorsplat {

// Fingerprints (core/fingerprint.h, 16 hexadecimal digits) of a run's inputs, which must match to resume from a
// checkpoint.

// All values of all Gaussians.
std::string FingerprintOf(const GaussianCloud& cloud);

// Poses and intrinsics in order, and the scene scale, which also depends on held-out cameras.
std::string FingerprintOf(const std::vector<Camera>& cameras, double scene_scale);

// The bytes of the cameras' pictures, in order: equally named files may show something else. Errors: those of
// MappedFile.
Result<std::string> FingerprintOfPictures(const std::vector<Camera>& cameras);

}  // namespace anchorsplat
