#pragma once

#include <cstdint>

#include "core/image.h"
#include "render/constants.h"
#include "render/projected_gaussian.h"

namespace anchorsplat {

// Sums over all pixels of one Gaussian in the coordinates (u, v) of ProjectedGaussian, where its ellipse is a circle.
// There sums have the magnitude of their terms; about the mean in pixels, a needle's covariance gradient would be a
// small difference of large numbers.
//
// With q = α·∂L/∂α of a pixel, 0 if α is capped:
struct BlendGradient {
  float q;       // Σ q, which is ∂L/∂ln(opacity)
  float qu, qv;  // Σ q·u, Σ q·v
  float quu, quv, qvv;
  float rgb[3];  // Σ α·T·∂L/∂C, which is ∂L/∂rgb

  BlendGradient& operator+=(const BlendGradient& more) {
    q += more.q;
    qu += more.qu;
    qv += more.qv;
    quu += more.quu;
    quv += more.quv;
    qvv += more.qvv;
    for (int c = 0; c < 3; ++c) rgb[c] += more.rgb[c];
    return *this;
  }
};

// Gradient of BlendCpu (Kerbl et al. 2023, appendix). Each tile is processed from the farthest Gaussian added to the
// nearest: T is recovered by division by 1 − α, and everything behind is a single number per pixel,
//   S = Σ_behind α·T·(rgb·∂L/∂C) + T_end·(background·∂L/∂C − ∂L/∂A),   α·∂L/∂α = α·T·(rgb·∂L/∂C) − S·α/(1 − α).
// Which Gaussians a pixel adds is decided by the same arithmetic as in BlendCpu.
//
// A Gaussian's sums are computed per tile and added in tile order, so they do not depend on the number of threads.
// Multiple threads store them in separate slots (render/gradient_slots.h) until then; a single thread adds them
// directly.
struct BlendBackwardParams {
  int width, height;                   // pixels
  int tiles_x;                         // T = tiles_x·⌈height/16⌉ tiles, row-major
  const ProjectedGaussian* projected;  // [N]
  const int64_t* tile_offsets;         // [T+1] for the whole image; fewer than 2^31 pairs per tile
  const int32_t* pairs;                // [tile_offsets[last_tile] − tile_offsets[first_tile]] rows, by tile and depth
  int64_t first_tile, last_tile;       // run of tiles to process
  float background[3];                 // rgb
  float min_alpha = kMinAlpha;
  float max_alpha = kMaxAlpha;
  const float* transmittance;   // [H,W] of BlendCpu
  const int32_t* contributors;  // [H,W] of BlendCpu
  PixelBox box;                 // within the image; outside, gradients count as 0 and are not read
  const float* color_gradient;  // [3,H,W] ∂L/∂C
  const float* alpha_gradient;  // [H,W] ∂L/∂A; may be null
  // scratch
  double* tile_backgrounds;  // [last_tile − first_tile, 3]
  // out, either: per Gaussian, to which a single thread adds the run's sums
  BlendGradient* gradients;  // [N]
  // or, if that is null, per slot; slots of tiles of this run are written
  const int64_t* slot_starts;  // GradientSlots::starts
  BlendGradient* sums;         // GradientSlots::sums
  uint8_t* touched;            // GradientSlots::touched, all 0 before
  // In addition to either, [..,2] Σ |∂L/∂x|, Σ |∂L/∂y| of the 2-D mean per pixel. ∂L/∂mean2d of a large Gaussian may
  // cancel because its pixels pull in all directions; this does not (Ye et al. 2024, AbsGS; gsplat's absgrad). Null:
  // skipped, at no cost.
  float* absolute;
  // in and out
  double* background_gradient;  // [3] adds Σ T_end·∂L/∂C
};

void BlendBackwardCpu(const BlendBackwardParams& p);

}  // namespace anchorsplat
