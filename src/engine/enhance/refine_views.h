#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "enhance/refine.h"
#include "enhance/refine_targets.h"
#include "render/rasterizer.h"

namespace anchorsplat {

// The views to compare with, and others to see whether it helped.
struct RefineViews {
  RefineTargets train, check;
  std::optional<double> input_psnr;
  double scene_scale = 1;
  RenderOptions render;
};

// Those that `options` and `input` name: pictures, cameras, or places around the splat. Errors: see Refine.
Result<RefineViews> OpenRefineViews(const RefineInput& input, const RefineOptions& options);

// The same views `factor` times larger, enlarged by the network in `file`, which can do that (CheckFactor of
// enhance/enlarged_targets.h). `start`: what is about to be refined. Errors: those of Upscaler::Read.
Status EnlargeViews(const std::filesystem::path& file, int factor, const GaussianCloud& start, RefineViews& views);

// How well `cloud`, seen closer and averaged down, agrees with views.check, means over the views. `input` is the splat
// that is refined. Pictures that may differ in brightness, or whose poses may be off (`options`), are measured where
// and as bright as they agree with `cloud` best.
Result<Consistency> MeasureConsistency(const GaussianCloud& cloud, double upscale, const GaussianCloud& input,
                                       const RefineOptions& options, RefineViews& views);

// What every Gaussian has to do with what the views find wrong: Σ over up to kResidualViews views and their pixels of
// its weight in the pixel × how far the picture is off there, 0–1. That weight is how the picture depends on its
// colour.
Result<std::vector<double>> Residuals(const GaussianCloud& cloud, double upscale, RefineViews& views);

}  // namespace anchorsplat
