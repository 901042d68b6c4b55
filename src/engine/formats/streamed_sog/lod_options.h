#pragma once

#include <cstdint>

namespace anchorsplat {

// Division of a splat into levels of detail and chunks.
struct LodOptions {
  int levels = 4;       // including the splat itself, 1–16
  double ratio = 0.25;  // Gaussians of a level relative to the next finer one, in (0, 1)
  // As in splat-transform:
  int chunk_count = 512;     // maximum Gaussians per chunk, in units of 1,024
  double chunk_extent = 16;  // maximum side of a tree leaf, world units, unless it has few Gaussians
};

}  // namespace anchorsplat
