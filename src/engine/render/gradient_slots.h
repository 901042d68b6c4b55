#pragma once

#include <cstdint>

#include "render/blend_backward.h"
#include "render/projected_gaussian.h"

namespace anchorsplat {

// Storage of per-tile sums. Every tile of a Gaussian's TileRect has a slot: Gaussians row by row, each with its tiles
// in row-major order. Tiles write without synchronisation, and summation reads contiguously, in an order independent of
// threads.
//
// The slot of Gaussian i and one of its tiles, in tiles, is
//   starts[i / kProjectChunk] + projected[i].slot + (tile_y − y0)·(x1 − x0) + (tile_x − x0).
struct GradientSlots {
  const int64_t* starts;  // [ProjectChunks(N)] first slot of each chunk
  BlendGradient* sums;    // [slots] undefined unless touched
  float* absolute;        // [slots,2] see BlendBackwardParams::absolute; null = skipped
  uint8_t* touched;       // [slots] 1 = the tile added something
};

// Number of tiles of `rect` before tile `tile` in row-major order, for a picture with `tiles_x` tiles per row.
int64_t TilesBefore(const TileRect& rect, int64_t tile, int tiles_x);

struct SlotsParams {
  int64_t count;                  // N Gaussians
  const TileRect* tiles;          // [N]
  const int32_t* visible;         // as ProjectParams::visible
  const int32_t* visible_counts;  // as ProjectParams::visible_counts
  int tiles_x, tiles_y;
  int64_t first_tile, last_tile;  // run of tiles with slots
  // in and out
  ProjectedGaussian* projected;  // [N] PlaceSlots writes `slot`

  bool covers_all() const { return first_tile == 0 && last_tile == int64_t{tiles_x} * tiles_y; }
};

// Assigns slots for a run of tiles, if all tiles need too many: shortens the run to at most `max_slots`, or a single
// tile, and updates the Gaussians' `slot`. Writes starts [ProjectChunks(N)] and returns the number of slots.
int64_t PlaceSlots(SlotsParams& p, int64_t max_slots, int64_t* starts);

// gradients[i] = Σ of the slots of Gaussian i, in tile order, for the visible Gaussians of a chunk; likewise absolute
// [N,2] if the slots have it. `first_run`: assign; otherwise add.
void SumSlots(const SlotsParams& p, const GradientSlots& slots, int64_t chunk, bool first_run, BlendGradient* gradients,
              float* absolute);

}  // namespace anchorsplat
