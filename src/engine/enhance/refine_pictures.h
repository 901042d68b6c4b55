#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "fit/picture_cache.h"
#include "render/rasterizer.h"

namespace anchorsplat {

// Agreement of a splat's renders with the pictures it was allegedly fitted to.
struct PictureAgreement {
  int64_t views = 0;       // views compared
  double psnr = 0;         // dB, mean
  int64_t mismatched = 0;  // views whose render matches another view's picture better than its own
  // Views whose picture matches the render better, by 2 dB or more, when moved or enlarged by a pixel, and the mean
  // gain, dB. A correct fit matches without moving.
  int64_t misplaced = 0;
  double misplaced_gain = 0;
  std::vector<std::string> far_below;  // names of views that match much worse than most
  int64_t plain = 0;                   // views whose picture is as close to a single colour as to the render
  // For standard fits: PSNR with the pictures reduced to a half, a quarter … (while kLeastSide pixels remain), where it
  // is highest. Such splats match pictures best at the size they were fitted to.
  double smaller_psnr = 0;
  int smaller = 1;  // that reduction: 2, 4, …; 1: not measured
};

inline constexpr int kLeastSide = 24;

// Compares up to 16 evenly spread views. Errors: those of PictureCache and Rasterizer.
Result<PictureAgreement> MeasureAgreement(const GaussianCloud& cloud, const RenderOptions& render,
                                          PictureCache& pictures);

// Only `views`, `psnr`, `smaller` and `smaller_psnr`, of all views whose pictures can be read.
Result<PictureAgreement> MeasureSizes(const GaussianCloud& cloud, const RenderOptions& render, PictureCache& pictures);

// How many times larger per side the pictures are than those the splat was fitted to: 1, 2, 4, …
int TimesLarger(const PictureAgreement& agreement);

// kBadArgument, with advice, if pictures and splat do not belong together; a warning if a few pictures do not.
// `aligned`:
// poses will be corrected, so they may be off.
Status CheckAgreement(const PictureAgreement& agreement, double least_psnr, bool aligned = false);

}  // namespace anchorsplat
