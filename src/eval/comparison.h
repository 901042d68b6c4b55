#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/result.h"
#include "eval/view_source.h"
#include "perceptual/lpips.h"

namespace anchorsplat {

struct ViewScore {
  std::string name;  // stem of the view
  double psnr = 0;   // dB; infinite for identical pictures
  double ssim = 0;
  std::optional<double> lpips;  // where it was asked for
};

struct Comparison {
  std::vector<ViewScore> views;  // in the reference's order
  double mean_psnr = 0;          // over the views; infinite when one of them is
  double mean_ssim = 0;
  std::optional<double> mean_lpips;
};

// Which view of each source shows what view r of the reference shows: [source][r]. Names match by path without folder
// and extension; two single pictures match whatever their names. A view without a partner and a stem that appears twice
// are errors (kBadArgument) that list them.
Result<std::vector<std::vector<size_t>>> MatchSources(std::span<ViewSource* const> sources,
                                                      const ViewSource& reference);

// PSNR, SSIM and LPIPS of every source against the reference, view by view; one result per source. Pictures of
// different sizes are an error that names them. `lpips` may be null. Shows progress.
Result<std::vector<Comparison>> CompareToReference(std::span<ViewSource* const> sources, ViewSource& reference,
                                                   const Lpips* lpips = nullptr);

}  // namespace anchorsplat
