#pragma once

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "fit/picture_cache.h"
#include "render/rasterizer.h"

namespace anchorsplat {

// How well a splat's renders agree with the pictures that it is said to have been fitted to.
struct PictureAgreement {
  int64_t views = 0;       // looked at
  double psnr = 0;         // dB, mean over them
  int64_t mismatched = 0;  // views whose render is nearer to another view's picture than to their own
};

// Looks at up to 16 views, evenly spread. Errors: those of PictureCache and Rasterizer.
Result<PictureAgreement> MeasureAgreement(const GaussianCloud& cloud, const RenderOptions& render,
                                          PictureCache& pictures);

// kBadArgument with what to look for, when `agreement` says that pictures and splat do not belong together.
Status CheckAgreement(const PictureAgreement& agreement, double least_psnr);

}  // namespace anchorsplat
