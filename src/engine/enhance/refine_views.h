#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "enhance/refine.h"
#include "enhance/refine_pictures.h"
#include "enhance/refine_targets.h"
#include "fit/training_views.h"
#include "render/rasterizer.h"

namespace anchorsplat {

// Target views, and held-out views to check the result.
struct RefineViews {
  RefineTargets train, check;
  std::optional<double> input_psnr;
  int times_larger = 1;  // sides of the pictures over those of the pictures the splat was fitted to
  double scene_scale = 1;
  RenderOptions render;
};

// MeasureSizes (enhance/refine_pictures.h) of views with pictures, over the background of `options` or `cameras`.
Result<PictureAgreement> MeasureSizes(const CameraSet& cameras, const RefineOptions& options,
                                      const GaussianCloud& cloud);

// Opens the views that `options` and `input` name: pictures, cameras, or poses around the splat. Errors: see Refine.
Result<RefineViews> OpenRefineViews(const RefineInput& input, const RefineOptions& options);

// Replaces the views by ones `factor` times larger, enlarged by the network in `file` (see CheckFactor in
// enhance/enlarged_targets.h). `start`: the splat to refine. Errors: those of Upscaler::Read.
Status EnlargeViews(const std::filesystem::path& file, int factor, const GaussianCloud& start, RefineViews& views);

// Mean agreement of `cloud`, rendered closer and averaged down, with views.check. `input`: the splat being refined.
// With exposure or alignment in `options`, each picture is first adjusted to match `cloud` best.
Result<Consistency> MeasureConsistency(const GaussianCloud& cloud, double upscale, const GaussianCloud& input,
                                       const RefineOptions& options, RefineViews& views);

// Share of each Gaussian in the error of up to kResidualViews views: Σ over pixels of its blending weight × absolute
// error (0–1). The weight is the derivative of the pixel by the Gaussian's colour.
Result<std::vector<double>> Residuals(const GaussianCloud& cloud, double upscale, RefineViews& views);

}  // namespace anchorsplat
