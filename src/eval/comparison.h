#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/result.h"
#include "eval/view_source.h"
#include "perceptual/lpips.h"

namespace anchorsplat {

// How near a picture is to the truth once the affine map of its colours that brings it nearest was applied
// (metrics/color_correction.h).
struct CorrectedScore {
  double psnr = 0;
  double ssim = 0;
  std::optional<double> lpips;
};

struct ViewScore {
  std::string name;  // stem of the view
  double psnr = 0;   // dB; infinite for identical pictures
  double ssim = 0;
  std::optional<double> lpips;                // where it was asked for
  std::optional<CorrectedScore> corrected{};  // likewise
  size_t reference_view = 0;                  // which of the reference's it is
};

struct Comparison {
  std::vector<ViewScore> views;  // in the reference's order, without those that masks hide
  double mean_psnr = 0;          // over the views; infinite when one of them is
  double mean_ssim = 0;
  std::optional<double> mean_lpips;
  std::optional<CorrectedScore> mean_corrected;
};

// What is measured beside PSNR and SSIM.
struct CompareOptions {
  const Lpips* lpips = nullptr;
  bool color_correct = false;  // of every source to the reference, view by view
};

// Which view of each source shows what view r of the reference shows: [source][r]. Names match by path without folder
// and extension; two single pictures match whatever their names. A view without a partner and a stem that appears twice
// are errors (kBadArgument) that list them.
Result<std::vector<std::vector<size_t>>> MatchSources(std::span<ViewSource* const> sources,
                                                      const ViewSource& reference);

// PSNR, SSIM and LPIPS of every source against the reference, view by view; one result per source. Pixels that a mask
// of either leaves out do not count, and views of which nothing is left are in no result, which a warning says.
// Pictures of different sizes are an error that names them, and so is it when nothing is left of any view. Shows
// progress.
Result<std::vector<Comparison>> CompareToReference(std::span<ViewSource* const> sources, ViewSource& reference,
                                                   const CompareOptions& options = {});

}  // namespace anchorsplat
