#pragma once

#include <cstdint>

#include "render/projected_gaussian.h"

namespace anchorsplat {

// Lists, for every 16-px tile, the Gaussians that may touch it, in depth order. Done in two steps, as the lists of a
// large image with large Gaussians may not fit in memory at once: CountPairs computes the length of every list,
// ListPairs writes those of a run of tiles. Both visit the same tiles with the same code.
//
// A Gaussian's tiles are its TileRect; for a large one, only those that its ellipse intersects.
struct BinParams {
  int64_t count;                       // M Gaussians to list
  const int32_t* order;                // [M] rows by depth
  const TileRect* tiles;               // [N]
  const ProjectedGaussian* projected;  // [N]
  float min_alpha;                     // α at the edge of the ellipse
  int tiles_x, tiles_y;                // T = tiles_x·tiles_y tiles
  int64_t chunks;                      // C ≥ 1 pieces of the order for parallel work
  // out of CountPairs; ListPairs modifies them
  TileRect* tiles_by_depth;  // [M]
  uint32_t* chunk_counts;    // [C,T]
  // out of CountPairs
  int64_t* tile_offsets;  // first pair of each tile
};

void CountPairs(const BinParams& p);

// Writes the lists of tiles [first_tile, last_tile): row numbers, tile by tile, each in depth order. Runs must be
// consecutive, starting at tile 0. `pairs`: [tile_offsets[last_tile] − tile_offsets[first_tile] + chunks]; the last
// ones are scratch.
void ListPairs(const BinParams& p, int64_t first_tile, int64_t last_tile, int32_t* pairs);

// End of the longest run of tiles from `first_tile` whose lists have at most `max_pairs` pairs; at least one tile.
int64_t EndOfRun(const BinParams& p, int64_t first_tile, int64_t max_pairs);

}  // namespace anchorsplat
