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

// Scores after the affine colour correction that best matches the truth (metrics/color_correction.h).
struct CorrectedScore {
  double psnr = 0;
  double ssim = 0;
  std::optional<double> lpips;
};

struct ViewScore {
  std::string name;  // of the view (ViewLabels in cameras/view_labels.h)
  double psnr = 0;   // dB; infinite for identical pictures
  double ssim = 0;
  std::optional<double> lpips;                // if requested
  std::optional<CorrectedScore> corrected{};  // if requested
  size_t reference_view = 0;                  // index in the reference
};

struct Comparison {
  std::vector<ViewScore> views;  // in the reference's order, without fully masked ones
  double mean_psnr = 0;          // over the views; infinite if one of them is
  double mean_ssim = 0;
  std::optional<double> mean_lpips;
  std::optional<CorrectedScore> mean_corrected;
};

// Optional measurements.
struct CompareOptions {
  std::function<Result<double>(const Image& picture, const Image& truth)> lpips;  // measures LPIPS; empty: skipped
  bool color_correct = false;  // also scores after colour correction, view by view
};

// For each source and reference view r, the source's view of the same: [source][r], or kNoView. Names are matched as in
// MatchViews (metrics/compare.h); two single pictures always match. kBadArgument: a duplicate name.
inline constexpr size_t kNoView = static_cast<size_t>(-1);
Result<std::vector<std::vector<size_t>>> MatchSources(std::span<ViewSource* const> sources,
                                                      const ViewSource& reference);

// Compares every source with the reference view by view: PSNR, SSIM and optionally LPIPS; one result per source. Pixels
// masked in either do not count. Fully masked views, and those that the reference or a source lacks, are left out with
// a warning. Errors: pictures of different sizes (named); all views fully masked. Shows progress.
Result<std::vector<Comparison>> CompareToReference(std::span<ViewSource* const> sources, ViewSource& reference,
                                                   const CompareOptions& options = {});

}  // namespace anchorsplat
