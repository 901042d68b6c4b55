#pragma once

#include <cstdint>

#include "render/constants.h"
#include "render/projected_gaussian.h"

namespace anchorsplat {

// Front-to-back compositing of a run of tiles (Kerbl et al. 2023, eq. 3):
//   skip α < min_alpha; stop before the Gaussian that would bring T to min_transmittance or below;
//   C += α·T·rgb; T ← T·(1 − α); at the end C += T·background.
//
// Per tile, batches of 16 listed Gaussians are tested against its sixteen 4×4-pixel blocks with the exact extent of the
// ellipse per row of blocks. Each block then composites its own short list, with its pixels in the lanes of a register.
struct BlendParams {
  int width, height;                   // pixels
  int tiles_x;                         // T = tiles_x·⌈height/16⌉ tiles, row-major
  const ProjectedGaussian* projected;  // [N]
  const int64_t* tile_offsets;         // [T+1] for the whole image
  const int32_t* pairs;                // [tile_offsets[last_tile] − tile_offsets[first_tile]] rows, by tile and depth
  int64_t first_tile, last_tile;       // run of tiles to blend
  float background[3];                 // rgb
  float min_alpha = kMinAlpha;
  float max_alpha = kMaxAlpha;
  float min_transmittance = kMinTransmittance;
  // out; only pixels of the run's tiles are written
  float* color;           // [3,H,W] including background
  float* alpha;           // [H,W] 1 − T
  float* depth;           // [H,W] Σ α·T·z / (1 − T), world units, 0 if 1 − T is 0; may be null
  float* transmittance;   // [H,W] T for the backward pass, more precise than 1 − alpha; may be null
  int32_t* contributors;  // [H,W] 1 + index in the tile's list of the last Gaussian added, 0 for none; may be null
  int64_t* evaluations;   // [T] (block, Gaussian) evaluations of the tile; may be null
};

void BlendCpu(const BlendParams& p);

}  // namespace anchorsplat
