#pragma once

#include <cstdint>

#include "render/blend_backward.h"
#include "render/projected_gaussian.h"

namespace anchorsplat {

// Where the tiles put what they find about a Gaussian. Every tile of its TileRect has a slot: rows of Gaussians one
// after another, and of each the tiles row by row. So tiles write without waiting for each other, and adding up reads
// what lies side by side, in an order that no number of threads changes.
//
// The slot of Gaussian i and one of its tiles is
//   starts[i / kProjectChunk] + projected[i].slot + (tile_y − y0)·(x1 − x0) + (tile_x − x0),   in tiles.
struct GradientSlots {
  const int64_t* starts;  // [ProjectChunks(N)] first slot of each chunk
  BlendGradient* sums;    // [slots] of one tile; those that were not touched hold anything
  float* absolute;        // [slots,2] of BlendBackwardParams::absolute; null = not wanted
  uint8_t* touched;       // [slots] 1 = the tile has added something
};

// Tiles of `rect` before tile `tile` of a picture of `tiles_x` in a row, all in the order of rows.
int64_t TilesBefore(const TileRect& rect, int64_t tile, int tiles_x);

struct SlotsParams {
  int64_t count;                  // N Gaussians
  const TileRect* tiles;          // [N]
  const int32_t* visible;         // as ProjectParams::visible
  const int32_t* visible_counts;  // as ProjectParams::visible_counts
  int tiles_x, tiles_y;
  int64_t first_tile, last_tile;  // the run of tiles that there are slots for
  // in and out
  ProjectedGaussian* projected;  // [N] PlaceSlots writes `slot`

  bool covers_all() const { return first_tile == 0 && last_tile == int64_t{tiles_x} * tiles_y; }
};

// Slots of a run of tiles only, where those of all tiles would be too many: the run becomes shorter until it has at
// most `max_slots`, or a single tile, and `slot` of the Gaussians is made to fit. Writes starts [ProjectChunks(N)] and
// returns how many slots there are.
int64_t PlaceSlots(SlotsParams& p, int64_t max_slots, int64_t* starts);

// gradients[i] = Σ of the slots of Gaussian i, in the order of the tiles, for the visible ones of a chunk; and absolute
// [N,2] where the slots have that. `first_run`: whether the slots are the first ones, otherwise they are added.
void SumSlots(const SlotsParams& p, const GradientSlots& slots, int64_t chunk, bool first_run, BlendGradient* gradients,
              float* absolute);

}  // namespace anchorsplat
