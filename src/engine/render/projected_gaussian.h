#pragma once

#include <cstddef>
#include <cstdint>

namespace anchorsplat {

// A projected Gaussian, in one cache line because blending accesses it at random.
//
// The conic is stored as a Cholesky factor, scaled so that blending needs neither a logarithm nor a sign check:
//   with d = pixel − (x, y):  u = u_xx·d_x + u_xy·d_y,  v = u_yy·d_y,  log2 α = log2_opacity − (u² + v²).
// The sum of squares cannot become negative by rounding and stays accurate for long thin Gaussians, whose A·dx² +
// 2B·dx·dy + C·dy² would be a small difference of large numbers.
struct alignas(64) ProjectedGaussian {
  double x, y;         // mean, pixels, pixel centres at +0.5. At x = 1000 floats are 6e-5 px apart: too coarse
  float u_xx;          // 1/px, sqrt(½·log2 e)·sqrt(Σyy/det)
  float u_xy;          // 1/px, −sqrt(½·log2 e)·Σxy/sqrt(Σyy·det)
  float u_yy;          // 1/px, sqrt(½·log2 e)/sqrt(Σyy)
  float log2_opacity;  // ≤ 0; includes the compensation of modes that have one
  float rgb[3];        // ≥ 0; written by the SH stage
  float depth;         // camera z, world units
  // For the backward pass:
  float compensation;         // factor of the opacity (RenderOptions::compensated_from), 1 in RenderMode::kClassic
  int32_t slot;               // slot of its first tile within its chunk (render/gradient_slots.h)
  uint16_t tile_x0, tile_y0;  // of its TileRect
  uint16_t tiles_across;
};
static_assert(sizeof(ProjectedGaussian) == 64);
// Blending copies four at once.
static_assert(offsetof(ProjectedGaussian, log2_opacity) == offsetof(ProjectedGaussian, u_xx) + 12);
static_assert(offsetof(ProjectedGaussian, depth) == offsetof(ProjectedGaussian, rgb) + 12);

// Tiles that a Gaussian may touch, half-open: columns [x0, x1), rows [y0, y1). All 0 if culled.
struct TileRect {
  uint16_t x0, y0, x1, y1;
};

}  // namespace anchorsplat
