#pragma once

#include <string>

#include "core/buffer.h"
#include "core/gaussian_cloud.h"

namespace anchorsplat {

// Sets the means of a cloud from `world` [N,3], double-precision positions in the file, relative to a chosen origin
// where floats need one (core/world_origin.h), which is added to the cloud's. Other columns must be set. Warns, with
// the file name, if Gaussians are so far apart that positions are rounded anyway.
void MeansFromWorld(const std::string& file, const Buffer<double>& world, GaussianCloud& cloud);

}  // namespace anchorsplat
