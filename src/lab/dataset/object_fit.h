#pragma once

#include <array>

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "dataset/object_settings.h"
#include "fit/fit_options.h"
#include "fit/training_views.h"

namespace anchorsplat {

// Fit options for an object's settings. `upscale`: high pixels per low pixel side. `background`: of its pictures.
// kBadArgument: settings that this program cannot fit.
Result<FitOptions> ToFitOptions(const ObjectSettings& settings, double upscale, const std::array<float, 3>& background);

// Its initial Gaussians. kBadArgument: no points.
Result<GaussianCloud> InitialCloudOf(const ObjectSettings& settings, const FitOptions& options,
                                     const TrainingViews& views);

}  // namespace anchorsplat
