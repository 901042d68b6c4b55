#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "scene/mesh.h"

namespace anchorsplat {

// Pictures in the room of room.h, with detail of every size down to a millimetre or less, so that closer views show
// more. Each depends on its seed only, on every machine. Those that repeat on a surface are seamless.
Texture WoodFloorPicture(uint64_t seed);  // planks, 2.4 m a side
Texture WallpaperPicture(uint64_t seed);  // stripes, rosettes and fine print, 0.5 m a side
Texture PlasterPicture(uint64_t seed);    // the ceiling, 1 m a side
Texture RugPicture(uint64_t seed);        // 2.4 m by 1.6 m
Texture LandscapePicture(uint64_t seed);  // a painting, 1.1 m by 0.75 m
Texture OutdoorsPicture(uint64_t seed);   // what is seen through the window: sky, hills, houses
Texture CurtainPicture(uint64_t seed);    // woven stripes, 0.3 m a side
Texture ReadingChartPicture();            // lines of smaller and smaller letters, 0.7 m by 1 m

// Book spines with titles, side by side: book i is the strip from 2i/n to 2(i+1)/n of the width of the upper (i < n/2)
// or lower half.
inline constexpr int kBookSpines = 64;
Texture BookSpinesPicture(uint64_t seed);

}  // namespace anchorsplat
