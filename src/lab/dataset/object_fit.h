#pragma once

#include <array>

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "dataset/object_settings.h"
#include "fit/fit_options.h"
#include "fit/training_views.h"

namespace anchorsplat {

// The fit that an object's settings ask for. `upscale`: high pixels per low one, along a side; `background`: of its
// pictures. kBadArgument: what this program's fits cannot do.
Result<FitOptions> ToFitOptions(const ObjectSettings& settings, double upscale, const std::array<float, 3>& background);

// The Gaussians that it begins with. kBadArgument: no points.
Result<GaussianCloud> InitialCloudOf(const ObjectSettings& settings, const FitOptions& options,
                                     const TrainingViews& views);

}  // namespace anchorsplat
