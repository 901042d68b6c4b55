#pragma once

#include "core/image.h"
#include "upscale/feature_map.h"

namespace anchorsplat {

// Depth to space (Shi et al. 2016): pixel (x·s + i, y·s + j) of channel c of `out` is channel (c·s + j)·s + i of the
// map's pixel (x, y). Only the map's pixels in `box`, of which the first one's picture begins at `to_x`, `to_y` of
// `out` [C, ·, ·]; the map has C·s² channels.
void PixelShuffle(const FeatureMap& map, const PixelBox& box, int scale, int to_x, int to_y, Image& out);

}  // namespace anchorsplat
