#pragma once

#include <cstdint>
#include <optional>

#include "core/gaussian_cloud.h"
#include "enhance/enhance.h"
#include "enhance/pixel_size_guard.h"
#include "enhance/trained_kind.h"

namespace anchorsplat {

// Whether a network that nobody asked for enhances a splat that has width to get back, or the filter takes its place.
// Networks have learned what splats of a kind have lost. Where that is not known they take pixels that are small enough
// to harm none; nearly round Gaussians, few, and views hardly nearer are the filter's. A pixel that is too small harms
// little: from a fifth of the true one on networks give back more than the filter does (docs/results/pixel-size.md).
// `unknown_of_few`: neither file nor sizes nor caller say the kind, and there are few Gaussians.
void ChooseNetwork(const EnhanceOptions& options, bool unknown_of_few, MethodPlan& plan, EnhanceInput& input,
                   EnhanceReport& report);

// What the default network takes of the pixel size that was found of all of a splat, for those who want to say so
// before: less than 1 where the kind is unclear, the estimate rough or the pictures seem to be soft. `showing`:
// ShowingGaussians::all, of `all` Gaussians.
double ShareForNetwork(std::optional<TrainedKind> looks, const GaussianCloud& showing, int64_t all,
                       const PixelSizeFinding& finding);

// A network that nobody asked for, where pixels are known of some things of the splat only: it takes those. Beside them
// small pieces of finer pixels lose 0.1 dB by it.
bool TakesSureOnly(const MethodPlan& plan, const EnhanceInput& input);

}  // namespace anchorsplat
