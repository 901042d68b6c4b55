#include "enhance/enhance.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "cameras/camera_axes.h"
#include "core/log.h"
#include "core/run_context.h"
#include "core/splat_comments.h"
#include "core/statistics.h"
#include "core/stopwatch.h"
#include "core/text.h"
#include "enhance/choose_treatment.h"
#include "enhance/clean.h"
#include "enhance/enhance_region.h"
#include "enhance/filter.h"
#include "enhance/gaussian_budget.h"
#include "enhance/refine_method.h"
#include "fit/pixel_model.h"

namespace anchorsplat {

namespace {

// Drops rows that no method and no viewer can use, and logs their number.
Status DropUnusable(GaussianCloud& cloud) {
  if (CountUnusable(cloud) == 0) return {};
  std::vector<int64_t> kept;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (IsUsable(cloud, i)) kept.push_back(i);
  }
  const int64_t dropped = cloud.size() - static_cast<int64_t>(kept.size());
  if (dropped == 0) return {};
  if (kept.empty()) {
    return Error{ErrorCode::kBadFile,
                 Cat(kNoneUsable, WithThousands(cloud.size()), " Gaussians can be drawn: all have ", kWhyUnusable)};
  }
  LogWarning(
      Cat("dropped ", WithThousands(dropped), " of ", WithThousands(cloud.size()), " Gaussians with ", kWhyUnusable));
  ANCHORSPLAT_ASSIGN_OR_RETURN(cloud, Subset(cloud, kept));
  return {};
}

// Runs one method and adds its report.
Result<GaussianCloud> RunStep(const EnhanceMethod& method, EnhanceInput input, const EnhanceOptions& options,
                              EnhanceReport& report) {
  StepReport step;
  step.method = method.name;
  ANCHORSPLAT_ASSIGN_OR_RETURN(GaussianCloud out, method.run(std::move(input), options, step));
  report.dropped += step.dropped;
  report.interrupted |= step.interrupted;
  report.steps.push_back(std::move(step));
  return out;
}

}  // namespace

std::string_view NameOf(PixelSizeSource source) {
  switch (source) {
    case PixelSizeSource::kNone:
      return "";
    case PixelSizeSource::kGiven:
      return "given";
    case PixelSizeSource::kCameras:
      return "cameras";
    case PixelSizeSource::kPictures:
      return "pictures";
    case PixelSizeSource::kRead:
      return "read";
    case PixelSizeSource::kUnknown:
      return "unknown";
  }
  return "";
}

const EnhanceMethod& FilterMethod() {
  static const EnhanceMethod method = {
      .name = "filter",
      .summary = "undo the thinning of a standard fit; instant, no network",
      .rank = 0,
      .options =
          [] {
            std::vector<MethodOption> options = WidthOptions();
            options.push_back(BudgetOption());
            return options;
          }(),
      .expected_gaussians = [](int64_t count, const EnhanceOptions& options) -> int64_t {
        return options.max_gaussians > 0 ? std::min(count, options.max_gaussians) : count;
      },
      .seconds_per_gaussian = [](const EnhanceOptions&) { return 4e-7; },
      .ready = [](const EnhanceOptions&) { return Status(); },
      .run = [](EnhanceInput input, const EnhanceOptions& options, StepReport&) -> Result<GaussianCloud> {
        KeepOnlyRegion(input);
        ANCHORSPLAT_RETURN_IF_ERROR([&]() -> Status {
          const auto grown = ApplyFilter(input.cloud, input.pixel_sizes,
                                         {.upscale = options.upscale, .strength = input.filter_strength});
          return grown.ok() ? Status() : Status(grown.error());
        }());
        return std::move(input.cloud);
      }};
  return method;
}

const std::vector<EnhanceMethod>& BasicMethods() {
  static const std::vector<EnhanceMethod> methods = {FilterMethod(), RefineMethod(), RefineImagesMethod(),
                                                     DetailMethod()};
  return methods;
}

const std::vector<EnhanceMethod>& MethodsOf(const EnhanceOptions& options) {
  return options.methods == nullptr ? BasicMethods() : *options.methods;
}

bool IsInvented(const EnhanceReport& report) {
  return std::ranges::any_of(report.steps, [](const StepReport& step) {
    return std::ranges::find(step.facts, Fact("invented", true)) != step.facts.end();
  });
}

int64_t ExpectedGaussians(int64_t count, const EnhanceOptions& options) {
  const Result<MethodPlan> plan = PlanEnhancement(options);
  if (!plan.ok()) return count;
  if (plan->start != nullptr) count = plan->start->expected_gaussians(count, options);
  return plan->method->expected_gaussians(count, options);
}

std::optional<double> ExpectedSeconds(int64_t count, const EnhanceOptions& options, int threads) {
  const Result<MethodPlan> plan = PlanEnhancement(options);
  if (!plan.ok() || plan->start != nullptr) return std::nullopt;
  const double each = plan->method->seconds_per_gaussian(options);
  return each > 0 ? std::optional(static_cast<double>(count) * each / std::max(1, threads)) : std::nullopt;
}

namespace {

Status CheckTask(const GaussianCloud& cloud, const EnhanceOptions& options) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(cloud));
  if (cloud.empty()) return Error{ErrorCode::kBadArgument, "the splat has no Gaussians"};
  if (!(options.upscale >= 1) || !std::isfinite(options.upscale)) {
    return Error{ErrorCode::kBadArgument, Cat("--upscale ", options.upscale, " must be at least 1")};
  }
  for (const float channel : options.background.value_or(std::array<float, 3>{})) {
    if (!(channel >= 0 && channel <= 1)) {
      return Error{ErrorCode::kBadArgument, Cat("background ", channel, " is not from 0 to 1")};
    }
  }
  if (options.background && !options.clean) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const MethodPlan plan, PlanEnhancement(options));
    const auto looks = [](const MethodOption& option) { return option.name == "background"; };
    if (std::ranges::none_of(plan.method->options, looks)) {
      return Error{ErrorCode::kBadArgument, "a background has no effect without --clean or refinement"};
    }
  }
  if (options.filter_strength && !(*options.filter_strength >= 0 && *options.filter_strength <= kMaxFilterStrength)) {
    return Error{ErrorCode::kBadArgument,
                 Cat("--filter-strength ", *options.filter_strength, " is not between 0 and ", kMaxFilterStrength)};
  }
  return CheckOptions(options);
}

// Which of a plan's methods need pixel sizes.
struct SizedMethods {
  bool start = false;
  bool any = false;
};

Result<SizedMethods> FindSizedMethods(const MethodPlan& plan, const EnhanceOptions& options) {
  SizedMethods sized;
  ANCHORSPLAT_ASSIGN_OR_RETURN(sized.any, plan.method->needs_pixel_size(options));
  if (plan.start != nullptr) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(sized.start, plan.start->needs_pixel_size(options));
    sized.any |= sized.start;
  }
  return sized;
}

// Whether the strength exceeds what the closer view's own pixels add.
bool GivesWidth(double strength, double upscale, std::optional<RenderMode> mode) {
  return strength > ShownStrength(upscale, mode);
}

// Runs the methods in order.
Result<GaussianCloud> RunPlan(const MethodPlan& plan, const SizedMethods& sized, EnhanceInput input,
                              const EnhanceOptions& options, EnhanceReport& report) {
  if (plan.start != nullptr) {
    EnhanceInput first = input;
    if (!sized.start) first.pixel_sizes.clear();
    EnhanceOptions of_first = options;
    of_first.control = {};  // only the last method writes the checkpoint
    first.is_refined = true;
    ANCHORSPLAT_ASSIGN_OR_RETURN(input.start, RunStep(*plan.start, std::move(first), of_first, report));
    input.start_has_detail = plan.start->adds_detail;
  }
  return RunStep(*plan.method, std::move(input), options, report);
}

// Runs the network on some Gaussians (by_network) and the filter on the others.
Result<GaussianCloud> RunOnSome(const MethodPlan& plan, EnhanceInput input, EnhanceOptions options,
                                EnhanceReport& report) {
  EnhanceInput others = input;
  if (input.in_region.empty()) input.in_region.assign(input.by_network.size(), 1);
  others.in_region = input.in_region;
  for (size_t i = 0; i < input.by_network.size(); ++i) (input.by_network[i] != 0 ? others : input).in_region[i] = 0;
  const auto left = std::ranges::count(others.in_region, 1), taken = std::ranges::count(input.in_region, 1);
  MethodPlan filter = plan;
  filter.method = &FilterMethod();
  if (taken == 0) return RunStep(*filter.method, std::move(others), options, report);
  if (left == 0) return RunStep(*plan.method, std::move(input), options, report);
  ANCHORSPLAT_ASSIGN_OR_RETURN(GaussianCloud filtered, RunStep(*filter.method, std::move(others), options, report));
  // Splits the budget in proportion.
  if (options.max_gaussians > 1) {
    const auto share = static_cast<double>(left) / static_cast<double>(left + taken);
    const auto most = static_cast<int64_t>(share * static_cast<double>(options.max_gaussians));
    DropLeastVisible(std::clamp(most, int64_t{1}, options.max_gaussians - 1), filtered);
    SetBudget(options, options.max_gaussians - filtered.size());
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(GaussianCloud out, RunStep(*plan.method, std::move(input), options, report));
  ANCHORSPLAT_RETURN_IF_ERROR(Append(out, filtered));
  return out;
}

}  // namespace

namespace {

// Enhance() for a splat whose means are world coordinates.
Result<Enhanced> EnhanceFromOrigin(GaussianCloud cloud, const EnhanceOptions& options) {
  const Stopwatch in_all;
  ANCHORSPLAT_RETURN_IF_ERROR(CheckTask(cloud, options));
  ANCHORSPLAT_ASSIGN_OR_RETURN(MethodPlan plan, PlanEnhancement(options));
  EnhanceReport report;
  report.quality = options.quality;
  report.upscale = options.upscale;
  report.gaussians_in = cloud.size();
  EnhanceInput input;
  input.cloud = std::move(cloud);
  ANCHORSPLAT_RETURN_IF_ERROR(DropUnusable(input.cloud));
  report.dropped = report.gaussians_in - input.cloud.size();
  if (options.cameras) {
    const std::string wrong = WrongAxes(*options.cameras, input.cloud.means);
    if (!wrong.empty()) LogWarning("--cameras: " + wrong);
  }
  // Marks of other regions do not concern this one.
  std::vector<std::string> marks_of_parts;
  if (options.region) {
    const auto is_mark = [](const std::string& comment) { return comment.starts_with(kPartEnhancedMark); };
    std::ranges::copy_if(input.cloud.comments, std::back_inserter(marks_of_parts), is_mark);
    std::erase_if(input.cloud.comments, is_mark);
    input.partly_enhanced = !marks_of_parts.empty();
  }

  if (options.mode) input.cloud.render_mode = options.mode;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const SizedMethods sized, FindSizedMethods(plan, options));
  if (options.clean) ANCHORSPLAT_RETURN_IF_ERROR(Clean(options, input.cloud, report));
  const std::string planned = plan.Name();
  if (sized.any) {
    ANCHORSPLAT_RETURN_IF_ERROR(ChooseTreatment(options, plan, input, report));
  } else if (IsMarkedEnhanced(input.cloud)) {
    LogWarning("the splat is already enhanced, unlike the training data of the network. Pass the original");
  }
  report.method = plan.Name();

  if (report.pixel_size_source == PixelSizeSource::kUnknown) {
    report.filter_strength = 0;
    report.gaussians_out = input.cloud.size();
    report.seconds_in_all = in_all.Total();
    return Enhanced{std::move(input.cloud), std::move(report)};
  }

  LeaveIfAbandoned();
  if (options.starting && plan.Name() == planned &&
      (!sized.any || report.filter_strength > 0 || plan.method->invents(options))) {
    options.starting();
  }
  const Stopwatch watch;
  EnhanceOptions within = options;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const GaussianCloud rest, SplitOffOutside(options, input, within, report));
  const bool some = !input.by_network.empty() && plan.start == nullptr;
  ANCHORSPLAT_ASSIGN_OR_RETURN(GaussianCloud out, some ? RunOnSome(plan, std::move(input), within, report)
                                                       : RunPlan(plan, sized, std::move(input), within, report));
  // Applies to methods without a limit of their own, and to rounding at a region's border.
  (void)DropLeastVisible(within.max_gaussians, out);
  if (options.region) ANCHORSPLAT_RETURN_IF_ERROR(Append(out, rest));
  report.seconds = watch.Total();
  report.seconds_in_all = in_all.Total();
  report.gaussians_out = out.size();
  out.comments.insert(out.comments.end(), marks_of_parts.begin(), marks_of_parts.end());
  const bool invented = IsInvented(report);
  if (!sized.any || invented || GivesWidth(report.filter_strength, options.upscale, out.render_mode)) {
    std::string mark = options.region ? PartEnhancedComment(report.method, options.upscale, invented)
                                      : EnhancedComment(report.method, options.upscale, invented);
    if (std::ranges::find(out.comments, mark) == out.comments.end()) out.comments.push_back(std::move(mark));
  }
  return Enhanced{std::move(out), std::move(report)};
}

}  // namespace

Result<Enhanced> Enhance(GaussianCloud cloud, const EnhanceOptions& options) {
  const WorldOrigin origin = std::exchange(cloud.origin, {});
  const bool double_means = std::exchange(cloud.double_means, false);
  EnhanceOptions from_origin = options;
  from_origin.refine.origin = origin;
  if (options.cameras) from_origin.cameras = RelativeToOrigin(*options.cameras, origin);
  if (options.region) from_origin.region = RelativeToOrigin(*options.region, origin);
  ANCHORSPLAT_ASSIGN_OR_RETURN(Enhanced enhanced, EnhanceFromOrigin(std::move(cloud), from_origin));
  enhanced.cloud.origin = origin;
  enhanced.cloud.double_means = double_means;
  return enhanced;
}

}  // namespace anchorsplat
