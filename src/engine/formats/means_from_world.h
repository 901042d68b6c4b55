#pragma once

#include <string>

#include "core/buffer.h"
#include "core/gaussian_cloud.h"

namespace anchorsplat {

// Makes the means of a cloud whose other rows are read from `world`, [N,3], as the file has them in double: floats from
// an origin on, where floats need one (core/world_origin.h), which is added to the cloud's. Warns, with the name of the
// file, where Gaussians lie so far from each other that positions are rounded all the same.
void MeansFromWorld(const std::string& file, const Buffer<double>& world, GaussianCloud& cloud);

}  // namespace anchorsplat
