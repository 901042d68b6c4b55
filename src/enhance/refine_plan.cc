#include "enhance/refine_plan.h"

#include <algorithm>
#include <numeric>
#include <vector>

#include "core/log.h"
#include "core/text.h"
#include "enhance/refine_copies.h"
#include "enhance/split_gaussians.h"

namespace anchorsplat {

namespace {

constexpr int64_t kStepsWithPictures = 1500, kStepsWithout = 600;
constexpr int kCopiesWithPictures = 8, kCopiesWithout = 4;
// Without pictures, a start that shows more than the splat does would lose it to what the splat shows: a few small
// steps bring what both know. Chosen on the validation objects (docs/refine.md).
constexpr int64_t kStepsGentle = 100;
constexpr double kRate = 1, kRateGentle = 0.1;
constexpr double kIndistinguishable = 58.9;  // dB: what rounding to 8 bits makes, 1/√12 of a step
constexpr double kGainOverFine = 2;          // dB at low resolution, see below

bool HasPictures(const RefineOptions& options) { return !options.images.empty(); }
bool IsGentle(const RefineInput& input, const RefineOptions& options) {
  return !HasPictures(options) && input.start_has_detail;
}

// K as `max_gaussians` allows it.
void LimitCopies(int64_t gaussians, RefineOptions& options) {
  if (options.max_gaussians == 0) return;
  options.copies = static_cast<int>(
      std::clamp<int64_t>(options.max_gaussians / std::max<int64_t>(1, gaussians), 1, *options.copies));
  if (gaussians > options.max_gaussians) {
    LogWarning(Cat("there are ", WithThousands(gaussians), " Gaussians before any is split, more than ",
                   WithThousands(options.max_gaussians), ": none is split, and none is left out"));
  }
}

}  // namespace

Result<RefineOptions> ChooseRefineOptions(const RefineInput& input, const RefineOptions& given) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(given));
  const bool pictures = HasPictures(given), gentle = IsGentle(input, given);
  if (!pictures && (given.exposure || given.robust || given.align)) {
    return Error{ErrorCode::kBadArgument, "exposure, robust and align are about photographs; they need --images"};
  }
  RefineOptions options = given;
  if (!options.seconds) {
    options.steps = given.steps.value_or(pictures ? kStepsWithPictures : gentle ? kStepsGentle : kStepsWithout);
  }
  options.rate = given.rate.value_or(gentle ? kRateGentle : kRate);
  if (gentle && !given.copies) options.copies = 1;
  return options;
}

Result<RefinePlan> PlanRefinement(const RefineInput& input, const RefineOptions& chosen, bool resumes,
                                  RefineViews& views) {
  RefinePlan plan;
  plan.options = chosen;
  const bool pictures = HasPictures(chosen);
  ANCHORSPLAT_ASSIGN_OR_RETURN(plan.before, MeasureConsistency(input.start, input.upscale, input.cloud, chosen, views));

  // A splat that was trained on larger pictures than these, or without dilation, knows details that these do not show;
  // learning them by heart costs it those. Measured with fits to views four times as large (docs/refine.md): one that
  // gained 1.5 dB at low resolution lost 0.5 dB at high resolution; one that gained 2.6 dB won there, too.
  if (pictures && IsCompensated(views.render.mode)) plan.least_gain = kGainOverFine;
  if (pictures) {
    // A splat that has lost no width is spoiled by what gives it back: the pictures tell.
    ANCHORSPLAT_ASSIGN_OR_RETURN(const double as_it_is,
                                 MeasureConsistency(input.cloud, input.upscale, input.cloud, chosen, views));
    if (as_it_is > plan.before) {
      plan.why = "the splat agrees better with the pictures as it is: the refinement begins with that";
      plan.before = as_it_is;
      plan.from_input = true;
      plan.least_gain = kGainOverFine;
    }
  } else if (plan.before >= kIndistinguishable) {
    plan.why = "the start shows what the splat does already, and is kept";
    plan.nothing_to_do = true;
    return plan;
  }

  const GaussianCloud& start = plan.from_input ? input.cloud : input.start;
  if (!plan.options.copies) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const ViewDensity density,
                                 MeasureDensity(input.cloud, views.render, views.train.views()));
    plan.options.copies = ChooseCopies(density, input.upscale, pictures ? kCopiesWithPictures : kCopiesWithout,
                                       input.cloud.size(), start.size());
  }
  LimitCopies(start.size(), plan.options);
  if (resumes) return plan;
  const int copies = *plan.options.copies;
  plan.gaussians = start.size() * copies;
  // More where the pictures find more wrong. Without pictures the differences are what the fit itself got wrong; copies
  // do not help there.
  if (pictures && copies > 1) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<double> residuals, Residuals(start, input.upscale, views));
    plan.each = CopiesByResidual(residuals, copies);
    plan.gaussians = std::accumulate(plan.each.begin(), plan.each.end(), int64_t{0});
  }
  return plan;
}

}  // namespace anchorsplat
