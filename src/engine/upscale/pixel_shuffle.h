#pragma once

#include "core/image.h"
#include "upscale/feature_map.h"

namespace anchorsplat {

// Depth to space (Shi et al. 2016): pixel (x·s + i, y·s + j) of channel c of `out` [C, ·, ·] is channel (c·s + j)·s + i
// of the map's pixel (x, y). The map has C·s² channels. Only the map's pixels in `box`; the first goes to (`to_x`,
// `to_y`).
void PixelShuffle(const FeatureMap& map, const PixelBox& box, int scale, int to_x, int to_y, Image& out);

}  // namespace anchorsplat
