#include "enhance/refine_plan.h"

#include <algorithm>
#include <numeric>
#include <vector>

#include "core/most_visible.h"
#include "core/text.h"
#include "enhance/refine_copies.h"
#include "enhance/split_gaussians.h"

namespace anchorsplat {

namespace {

constexpr int64_t kStepsWithPictures = 1500, kStepsWithout = 600;
constexpr int kCopiesWithPictures = 8, kCopiesWithout = 4;
// Without pictures, a start with more detail than the splat would lose it to the splat's renders; a few small steps
// keep what both agree on. Chosen on the validation objects (docs/refine.md).
constexpr int64_t kStepsGentle = 100;
constexpr double kRate = 1, kRateGentle = 0.1;
// Against enlarged views, which contradict each other slightly.
constexpr int64_t kStepsOfDetail = 300;
constexpr double kRateOfDetail = 0.3;
constexpr double kIndistinguishable = 58.9;  // dB of 8-bit rounding error, 1/√12 of a step
constexpr double kGainOverFine = 2;          // dB at low resolution, see below

bool HasPictures(const RefineOptions& options) { return !options.images.empty(); }
bool IsGentle(const RefineInput& input, const RefineOptions& options) {
  return !HasPictures(options) && input.start_has_detail;
}

// Copies per Gaussian within `max_gaussians`: the last `fixed` stay single, the rest goes to the largest opacity ×
// size. Empty if there is room for all.
std::vector<int> CopiesWithin(const GaussianCloud& start, int64_t fixed, RefineOptions& options) {
  const int64_t n = start.size() - fixed, most = options.max_gaussians;
  const bool bound = most > 0 && n * *options.copies > most;
  if (bound) options.copies = static_cast<int>(std::max<int64_t>(1, most / std::max<int64_t>(1, n)));
  if (!bound && fixed == 0) return {};
  std::vector<int> each(static_cast<size_t>(start.size()), 1);
  std::fill_n(each.begin(), n, *options.copies);
  if (!bound) return each;
  std::vector<int64_t> rows(static_cast<size_t>(n));
  std::iota(rows.begin(), rows.end(), int64_t{0});
  for (const int64_t row : MostVisible(start, rows, std::max<int64_t>(0, most - n * *options.copies))) {
    ++each[static_cast<size_t>(row)];
  }
  return each;
}

}  // namespace

int64_t KeepToBudget(int64_t max_gaussians, int64_t fixed, GaussianCloud& start) {
  const int64_t over = max_gaussians == 0 ? 0 : start.size() - fixed - max_gaussians;
  if (over <= 0) return 0;
  std::vector<int64_t> rows(static_cast<size_t>(start.size() - fixed));
  std::iota(rows.begin(), rows.end(), int64_t{0});
  rows = MostVisible(start, rows, max_gaussians);
  for (int64_t row = start.size() - fixed; row < start.size(); ++row) rows.push_back(row);
  start = Subset(start, rows).value();
  return over;
}

Result<RefineOptions> ChooseRefineOptions(const RefineInput& input, const RefineOptions& given) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(given));
  const bool pictures = HasPictures(given), gentle = IsGentle(input, given);
  if (!pictures && (given.exposure || given.robust || given.align)) {
    return Error{ErrorCode::kBadArgument, "--exposure, --robust and --align need --images"};
  }
  RefineOptions options = given;
  if (!options.seconds) {
    options.steps = given.steps.value_or(given.enlarged ? kStepsOfDetail
                                         : pictures     ? kStepsWithPictures
                                         : gentle       ? kStepsGentle
                                                        : kStepsWithout);
  }
  options.rate = given.rate.value_or(given.enlarged ? kRateOfDetail : gentle ? kRateGentle : kRate);
  if ((gentle || given.enlarged) && !given.copies) options.copies = 1;
  return options;
}

Result<RefinePlan> PlanRefinement(const RefineInput& input, const GaussianCloud& as_it_is, const RefineOptions& chosen,
                                  bool resumes, RefineViews& views) {
  RefinePlan plan;
  plan.options = chosen;
  const bool pictures = HasPictures(chosen);
  ANCHORSPLAT_ASSIGN_OR_RETURN(plan.start, MeasureConsistency(input.start, input.upscale, input.cloud, chosen, views));

  // A splat trained on larger pictures, or without dilation, has detail that these pictures lack, and fitting them
  // would destroy it. Measured on fits to views four times as large (docs/refine.md): one that gained 1.5 dB at low
  // resolution lost 0.5 dB at high resolution; one that gained 2.6 dB gained there, too.
  if (pictures && IsCompensated(views.render.mode)) plan.least_gain = kGainOverFine;
  if (pictures) {
    // Restoring width spoils a splat that lost none; the pictures decide.
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Consistency agreement,
                                 MeasureConsistency(as_it_is, input.upscale, input.cloud, chosen, views));
    if (agreement.psnr > plan.start.psnr) {
      plan.why = "starting from the input, which matches the pictures better";
      plan.start = agreement;
      plan.from_input = true;
      plan.least_gain = kGainOverFine;
    }
  } else if (plan.start.psnr >= kIndistinguishable && chosen.enlarge_with.empty()) {
    plan.why = "nothing to refine: the start already matches the splat";
    plan.nothing_to_do = true;
    return plan;
  }

  const GaussianCloud& start = plan.from_input ? as_it_is : input.start;
  if (!plan.options.copies) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const ViewDensity density,
                                 MeasureDensity(input.cloud, views.render, views.train.views()));
    plan.options.copies = ChooseCopies(density, input.upscale, pictures ? kCopiesWithPictures : kCopiesWithout,
                                       input.cloud.size(), start.size());
  }
  plan.each = CopiesWithin(start, input.fixed, plan.options);
  const int copies = *plan.options.copies;
  const int64_t changing = start.size() - input.fixed;
  plan.gaussians =
      plan.each.empty() ? start.size() * copies : std::accumulate(plan.each.begin(), plan.each.end(), int64_t{0});
  const int64_t wanted = plan.gaussians - input.fixed;
  if (resumes) {
    plan.each.clear();
    plan.gaussians = 0;
    return plan;
  }
  // More copies where the pictures show more error. Without pictures, errors are the fit's own, and copies do not help.
  if (pictures && wanted > changing) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(std::vector<double> residuals, Residuals(start, input.upscale, views));
    residuals.resize(static_cast<size_t>(changing));
    plan.each = CopiesByResidual(residuals, copies, wanted);
    plan.each.resize(static_cast<size_t>(start.size()), 1);
    plan.gaussians = std::accumulate(plan.each.begin(), plan.each.end(), int64_t{0});
  }
  return plan;
}

}  // namespace anchorsplat
