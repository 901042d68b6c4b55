#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "compare/view_source.h"
#include "core/image.h"
#include "core/result.h"

namespace anchorsplat {

// How near a picture is to the truth once the affine map of its colours that brings it nearest was applied
// (metrics/color_correction.h).
struct CorrectedScore {
  double psnr = 0;
  double ssim = 0;
  std::optional<double> lpips;
};

struct ViewScore {
  std::string name;  // the view's (ViewLabels in cameras/view_labels.h)
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
  std::function<Result<double>(const Image& picture, const Image& truth)> lpips;  // measures it; none: nobody asks
  bool color_correct = false;  // of every source to the reference, view by view
};

// Which view of each source shows what view r of the reference shows: [source][r], kNoView for none. Names match as
// MatchViews says (metrics/compare.h); two single pictures match whatever their names. kBadArgument: a name that
// appears twice.
inline constexpr size_t kNoView = static_cast<size_t>(-1);
Result<std::vector<std::vector<size_t>>> MatchSources(std::span<ViewSource* const> sources,
                                                      const ViewSource& reference);

// PSNR, SSIM and LPIPS of every source against the reference, view by view; one result per source. Pixels that a mask
// of either leaves out do not count. Views of which nothing is left, and those that one of the sources or the reference
// lacks, are in no result, which a warning says. Errors: pictures of different sizes, which are named; nothing is left
// of any view. Shows progress.
Result<std::vector<Comparison>> CompareToReference(std::span<ViewSource* const> sources, ViewSource& reference,
                                                   const CompareOptions& options = {});

}  // namespace anchorsplat
