#pragma once

#include <cstdint>

#include "render/projected_gaussian.h"

namespace anchorsplat {

// Lists, for every 16-px tile, the Gaussians that may touch it, in order of depth. Two steps, because the lists of a
// large image full of large Gaussians may not fit in memory at once: CountPairs says how long every list is,
// ListPairs writes those of a run of tiles. Both walk the same tiles by the same code.
//
// The tiles of a Gaussian are its TileRect, and of a large one only those that its ellipse meets.
struct BinParams {
  int64_t count;                       // M Gaussians to list
  const int32_t* order;                // [M] rows by depth
  const TileRect* tiles;               // [N]
  const ProjectedGaussian* projected;  // [N]
  float min_alpha;                     // edge of the ellipse
  int tiles_x, tiles_y;                // T = tiles_x·tiles_y tiles
  int64_t chunks;                      // C ≥ 1 pieces of the order that may be worked on at the same time
  // out of CountPairs, which ListPairs needs and changes
  TileRect* tiles_by_depth;  // [M]
  uint32_t* chunk_counts;    // [C,T]
  // out of CountPairs
  int64_t* tile_offsets;  // [T+1] first pair of each tile
};

void CountPairs(const BinParams& p);

// Writes the lists of tiles [first_tile, last_tile): row numbers, tile after tile, each by depth. Runs must follow one
// another from tile 0 on.
void ListPairs(
    const BinParams& p, int64_t first_tile, int64_t last_tile,
    int32_t* pairs);  // [tile_offsets[last_tile] − tile_offsets[first_tile] + chunks], the last ones as scratch

// The longest run of tiles from `first_tile` on whose lists hold `max_pairs` pairs, at least one tile.
int64_t EndOfRun(const BinParams& p, int64_t first_tile, int64_t max_pairs);

}  // namespace anchorsplat
