#pragma once

#include <cstdint>

namespace anchorsplat {

// How a splat is divided into levels of detail and chunks.
struct LodOptions {
  int levels = 4;       // with the splat itself, 1–16
  double ratio = 0.25;  // Gaussians of a level to those of the finer one, in (0, 1)
  // As splat-transform has them:
  int chunk_count = 512;     // Gaussians in a chunk, at most, in units of 1,024
  double chunk_extent = 16;  // longest side of a leaf of the tree, world units, unless few Gaussians are in it
};

}  // namespace anchorsplat
