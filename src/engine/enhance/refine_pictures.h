#pragma once

#include <cstdint>
#include <string>
#include <vector>

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
  // Views whose picture is nearer to the render when it is moved or enlarged by a pixel, by 2 dB and more, and by how
  // much on the mean, dB: a fit is where its cameras said.
  int64_t misplaced = 0;
  double misplaced_gain = 0;
  std::vector<std::string> far_below;  // names of views that agree much less than most
  int64_t plain = 0;                   // views whose picture is as near to a picture of one colour as to the render
  // The same with the pictures at a half, a quarter … of their size, as long as they have kLeastSide pixels, of splats
  // that standard fits made: these look right at the size of the pictures that they were fitted to, and worse at any
  // other.
  double smaller_psnr = 0;
  int smaller = 1;  // 2, 4, …: where that is highest; 1: it is not measured
};

inline constexpr int kLeastSide = 24;

// Looks at up to 16 views, evenly spread. Errors: those of PictureCache and Rasterizer.
Result<PictureAgreement> MeasureAgreement(const GaussianCloud& cloud, const RenderOptions& render,
                                          PictureCache& pictures);

// kBadArgument with what to look for, when `agreement` says that pictures and splat do not belong together. Warns when
// a few of them do not. `aligned`: their poses will be, and may be off.
Status CheckAgreement(const PictureAgreement& agreement, double least_psnr, bool aligned = false);

}  // namespace anchorsplat
