#include "enhance/enhance.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "cameras/camera_axes.h"
#include "core/log.h"
#include "core/lost_nothing_mark.h"
#include "core/run_context.h"
#include "core/statistics.h"
#include "core/stopwatch.h"
#include "core/text.h"
#include "enhance/choose_pixel_sizes.h"
#include "enhance/clean.h"
#include "enhance/enhance_region.h"
#include "enhance/enhanced_mark.h"
#include "enhance/filter.h"
#include "enhance/gaussian_budget.h"
#include "enhance/lost_width.h"
#include "enhance/network_choice.h"
#include "enhance/refine_method.h"
#include "enhance/showing_gaussians.h"
#include "enhance/soft_pictures.h"
#include "fit/pixel_model.h"

namespace anchorsplat {

namespace {

std::vector<EnhanceMethod>& Registry() {
  static std::vector<EnhanceMethod> methods = {
      {.name = "filter",
       .summary = "give the width back that the fit absorbed; instant, no weights",
       .rank = 0,
       .options =
           [] {
             std::vector<MethodOption> options = WidthOptions();
             options.push_back({"max-gaussians", {}});
             return options;
           }(),
       .expected = [](int64_t count, const EnhanceOptions& options) -> int64_t {
         return options.max_gaussians > 0 ? std::min(count, options.max_gaussians) : count;
       },
       .seconds = [](const EnhanceOptions&) { return 4e-7; },
       .ready = [](const EnhanceOptions&) { return Status(); },
       .run = [](EnhanceInput input, const EnhanceOptions& options, StepReport&) -> Result<GaussianCloud> {
         LeaveRegion(input);
         ANCHORSPLAT_RETURN_IF_ERROR([&]() -> Status {
           const auto grown = ApplyFilter(input.cloud, input.pixel_sizes,
                                          {.upscale = options.upscale, .strength = input.filter_strength});
           return grown.ok() ? Status() : Status(grown.error());
         }());
         return std::move(input.cloud);
       }},
      RefineMethod(),
      RefineImagesMethod()};
  return methods;
}

// Drops the rows no method and no viewer can use; says how many.
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
                 Cat(kNoneUsable, WithThousands(cloud.size()), " Gaussians can be drawn: each has ", kWhyUnusable)};
  }
  LogWarning(Cat("dropped ", WithThousands(dropped), " of ", WithThousands(cloud.size()), " Gaussians: ", kWhyUnusable,
                 ", so that nobody draws them"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(cloud, Subset(cloud, kept));
  return {};
}

// How it looks beside what its file says. Of a region, where that has enough Gaussians to tell: the rest may have been
// enhanced before. Where it has been, of the region at any rate.
std::optional<TrainedKind> FindLooks(const EnhanceOptions& options, const EnhanceInput& input) {
  const GaussianCloud& cloud = input.cloud;
  const int64_t enough_of_region = input.partly_enhanced ? 0 : 1000;
  ShowingGaussians showing = FindShowingGaussians(cloud);
  if (options.region) {
    std::vector<int64_t> inside, rows;
    for (int64_t i = 0; i < showing.all.size(); ++i) {
      if (!options.region->Holds(showing.all.means.data() + 3 * i)) continue;
      inside.push_back(i);
      rows.push_back(showing.rows_of_all[static_cast<size_t>(i)]);
    }
    if (std::ssize(inside) >= enough_of_region) {
      if (auto part = Subset(showing.all, inside); part.ok()) {
        showing.all = *std::move(part);
        showing.rows_of_all = std::move(rows);
      }
    }
  }
  const auto kind = BesideSoftness(TrainedKindOf(cloud, showing), cloud.render_mode, showing);
  return BesideTag(kind, cloud.render_mode, showing.all.size());
}

// Splats of which the caller does not say how they were trained are looked at. An antialiased one without a tag becomes
// one.
void RecogniseKind(const EnhanceOptions& options, EnhanceInput& input, EnhanceReport& report) {
  GaussianCloud& cloud = input.cloud;
  if (IsGiven(options, "mode") || options.filter_strength || HasLostNoWidth(cloud) ||
      cloud.render_mode == RenderMode::kMip)
    return;
  report.looks = FindLooks(options, input);
  if (!cloud.render_mode && report.looks == TrainedKind::kAntialiased) cloud.render_mode = RenderMode::kAntialiased;
}

void SayHowItLooks(TrainedKind looks, std::optional<RenderMode> tag) {
  if (looks == TrainedKind::kEnhanced) {
    LogWarning(
        Cat("the Gaussians of the splat lie in twins, as a network leaves them that has enhanced it: it has lost "
            "no width any more, and none is given back (--mode ",
            tag ? NameOf(*tag) : "classic or antialiased, where you know it,", " if it has not been enhanced)"));
    return;
  }
  if (looks == TrainedKind::kRaised) {
    LogWarning(
        "the opacities of the splat have been raised since it was trained: hardly a Gaussian is faint, which makes all "
        "wider than they were. Only a little width is given back; --mode classic or antialiased says more");
    return;
  }
  if (tag) {
    LogWarning(
        Cat("the splat is tagged ", NameOf(*tag),
            ", but even its thinnest Gaussians have a width, as Mip-Splatting and enhancing give them: it has lost "
            "none, and none is given back (--mode mip if it is of Mip-Splatting, --mode ",
            NameOf(*tag), " to enhance it as it is tagged)"));
    return;
  }
  switch (looks) {
    case TrainedKind::kAntialiased:
      LogWarning(
          "the splat does not say how it was trained; its thinnest Gaussians are like those of an antialiased "
          "training, and it is enhanced and tagged as an antialiased splat (--mode classic if it is none)");
      break;
    case TrainedKind::kWidened:
      LogWarning(
          "even the thinnest Gaussians of the splat have a width, as Mip-Splatting and enhancing give them: it has "
          "lost none, and none is given back (--mode classic if it was trained without such a width)");
      break;
    case TrainedKind::kUnclear:
      LogWarning(
          "it is unclear how the splat was trained, as its thinnest Gaussians are neither like those of classic nor "
          "of antialiased ones; it may have been enhanced. Only a little width is given back; --mode classic or "
          "antialiased, where you know it, says more");
      break;
    case TrainedKind::kEnhanced:
    case TrainedKind::kRaised:
    case TrainedKind::kClassic:
      break;
  }
}

// Neither file nor sizes nor caller say what kind of splat it is, nor how large its pixels were.
bool IsUnknownOfFew(const EnhanceOptions& options, const GaussianCloud& cloud, std::optional<TrainedKind> looks) {
  return !options.filter_strength && !options.pixel_size && !options.cameras && options.refine.images.empty() &&
         FindLostWidth(cloud, looks, options.upscale).reason == LostWidthReason::kTooFew &&
         cloud.size() < kFewGaussians;
}

// Of the filter. Splats that absorbed nothing have nothing to get back.
double ChooseStrength(const EnhanceOptions& options, const GaussianCloud& cloud, std::optional<TrainedKind> looks,
                      bool unknown_of_few) {
  if (options.filter_strength) return *options.filter_strength;
  const LostWidth lost = FindLostWidth(cloud, looks, options.upscale);
  if (lost.reason == LostWidthReason::kFittedToAreas) {
    LogWarning(
        "the splat was fitted to the areas of pixels: it has lost no width and none is given back (--filter-strength F "
        "to enhance it all the same)");
  } else if (lost.reason == LostWidthReason::kMarkedEnhanced) {
    LogWarning(
        "the splat says that it has been enhanced already: its lost width has been given back and none is given once "
        "more (--filter-strength F to enhance it all the same)");
  } else if (lost.reason == LostWidthReason::kPartMarked) {
    LogWarning(
        "the splat says that a part of it has been enhanced already, which would be given its lost width twice: it "
        "stays as it is (--region enhances another part, --filter-strength F all of it)");
  } else if (lost.strength > 0 && IsCompensated(cloud.render_mode) && options.upscale > 1) {
    LogInfo(Cat("the splat is ", NameOf(*cloud.render_mode), ": its fit lost less width, and less is given back (",
                Fixed(lost.strength, 2), " of what a classic one could have lost)"));
  }
  // Most are classic, and who knows the pixels has an eye on the rest.
  if (lost.reason == LostWidthReason::kTooFew && !unknown_of_few) {
    return DefaultFilterStrength(options.upscale);
  }
  return lost.strength;
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

void RegisterEnhanceMethod(EnhanceMethod method) {
  const auto same = std::ranges::find(Registry(), method.name, &EnhanceMethod::name);
  if (same == Registry().end()) {
    Registry().push_back(std::move(method));
  } else {
    *same = std::move(method);
  }
}
std::span<const EnhanceMethod> EnhanceMethods() { return Registry(); }

int64_t ExpectedGaussians(int64_t count, const EnhanceOptions& options) {
  const Result<MethodPlan> plan = PlanEnhancement(options);
  if (!plan.ok()) return count;
  if (plan->start != nullptr) count = plan->start->expected(count, options);
  return plan->method->expected(count, options);
}

std::optional<double> ExpectedSeconds(int64_t count, const EnhanceOptions& options, int threads) {
  const Result<MethodPlan> plan = PlanEnhancement(options);
  if (!plan.ok() || plan->start != nullptr) return std::nullopt;
  const double each = plan->method->seconds(options);
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
      return Error{ErrorCode::kBadArgument, Cat("the background's ", channel, " is not from 0 to 1")};
    }
  }
  if (options.background && !options.clean) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const MethodPlan plan, PlanEnhancement(options));
    const auto looks = [](const MethodOption& option) { return option.name == "background"; };
    if (std::ranges::none_of(plan.method->options, looks)) {
      return Error{ErrorCode::kBadArgument, "a background has no effect without cleaning (--clean) or refinement"};
    }
  }
  if (options.filter_strength && !(*options.filter_strength >= 0 && *options.filter_strength <= kMaxFilterStrength)) {
    return Error{ErrorCode::kBadArgument,
                 Cat("--filter-strength ", *options.filter_strength, " is not between 0 and ", kMaxFilterStrength)};
  }
  return CheckOptions(options);
}

// Which methods of a plan work with pixel sizes.
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

// More than what the closer view's own pixels add.
bool GivesWidth(double strength, double upscale, std::optional<RenderMode> mode) {
  return strength > ShownStrength(upscale, mode);
}

// A splat that has lost nothing stays as it is, whatever was asked for.
void SayWhatHasNoEffect(const EnhanceOptions& options) {
  std::string names;
  int count = 0;
  for (const char* name : {"pixel-size", "model", "copies", "merge-cost", "prune-opacity"}) {
    if (!IsGiven(options, name)) continue;
    names += Cat(count++ > 0 ? ", --" : "--", name);
  }
  if (count > 0) {
    LogWarning(
        Cat(names, count > 1 ? " have" : " has", " no effect, as there is no width to give back: the splat stays"));
  }
}

// The filter's strength and the pixel sizes, for methods that work with them.
Status ChooseWidths(const MethodPlan& plan, const EnhanceOptions& options, bool unknown_of_few, EnhanceInput& input,
                    EnhanceReport& report) {
  if (report.looks && options.upscale > 1) {
    SayHowItLooks(*report.looks, IsWide(report.looks) ? input.cloud.render_mode : std::nullopt);
  } else if (unknown_of_few && options.upscale > 1) {
    LogWarning(Cat("it is unclear how the splat was trained, as ", WithThousands(input.cloud.size()),
                   " Gaussians are too few to tell. Only a little width is given back; --mode classic or antialiased, "
                   "where you know it, says more"));
  }
  input.filter_strength = ChooseStrength(options, input.cloud, report.looks, unknown_of_few);
  report.filter_strength = input.filter_strength;
  const bool gives_width = GivesWidth(input.filter_strength, options.upscale, input.cloud.render_mode);
  if (options.filter_strength && *options.filter_strength > 0 && !gives_width && options.upscale > 1) {
    LogWarning(Cat("a strength of ", input.filter_strength, " is no more than what the closer view's own pixels add (",
                   ShownStrength(options.upscale, input.cloud.render_mode), "): nothing changes"));
  }
  if (gives_width && plan.chosen_by.empty() && plan.Name() == "filter" && !options.filter_strength &&
      input.cloud.render_mode == RenderMode::kAntialiased) {
    LogWarning(
        "the filter alone can take more than it gives from an antialiased splat of many Gaussians that overlap (up to "
        "3.5 dB were seen); the default, with a network, makes up for it");
  }
  if (!gives_width && options.upscale > 1) SayWhatHasNoEffect(options);
  ANCHORSPLAT_RETURN_IF_ERROR(ChoosePixelSizes(options, plan.method->takes_start && !options.refine.images.empty(),
                                               gives_width, input, report));
  input.pixel_size = report.pixel_size;
  return {};
}

// One method after the other.
Result<GaussianCloud> RunPlan(const MethodPlan& plan, const SizedMethods& sized, EnhanceInput input,
                              const EnhanceOptions& options, EnhanceReport& report) {
  if (plan.start != nullptr) {
    EnhanceInput first = input;
    if (!sized.start) first.pixel_sizes.clear();
    EnhanceOptions of_first = options;
    of_first.control = {};  // the checkpoint is the last one's
    first.is_refined = true;
    ANCHORSPLAT_ASSIGN_OR_RETURN(input.start, RunStep(*plan.start, std::move(first), of_first, report));
    input.start_has_detail = plan.start->adds_detail;
  }
  return RunStep(*plan.method, std::move(input), options, report);
}

// The others are the filter's.
Result<GaussianCloud> RunOnSure(const MethodPlan& plan, EnhanceInput input, EnhanceOptions options,
                                EnhanceReport& report) {
  EnhanceInput others = input;
  if (input.inside.empty()) input.inside.assign(input.sure.size(), 1);
  others.inside = input.inside;
  for (size_t i = 0; i < input.sure.size(); ++i) (input.sure[i] != 0 ? others : input).inside[i] = 0;
  const auto left = std::ranges::count(others.inside, 1), taken = std::ranges::count(input.inside, 1);
  MethodPlan filter = plan;
  filter.method = &*std::ranges::find(EnhanceMethods(), std::string("filter"), &EnhanceMethod::name);
  if (taken == 0) return RunStep(*filter.method, std::move(others), options, report);
  if (left == 0) return RunStep(*plan.method, std::move(input), options, report);
  LogInfo(Cat("the filter instead of '", plan.method->name, "' for ", WithThousands(left), " of ",
              WithThousands(left + taken), " Gaussians, whose pixels are not known or which have lost no width"));
  ANCHORSPLAT_ASSIGN_OR_RETURN(GaussianCloud filtered, RunStep(*filter.method, std::move(others), options, report));
  // Neither takes the other's share of a budget.
  if (options.max_gaussians > 1) {
    const auto share = static_cast<double>(left) / static_cast<double>(left + taken);
    const auto most = static_cast<int64_t>(share * static_cast<double>(options.max_gaussians));
    LeaveOutLeastVisible(std::clamp(most, int64_t{1}, options.max_gaussians - 1), filtered);
    SetBudget(options, options.max_gaussians - filtered.size());
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(GaussianCloud out, RunStep(*plan.method, std::move(input), options, report));
  ANCHORSPLAT_RETURN_IF_ERROR(Append(out, filtered));
  return out;
}

}  // namespace

namespace {

// Of a splat whose means are the world.
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
  // A mark of other parts says nothing about this one.
  std::vector<std::string> marks_of_parts;
  if (options.region) {
    const auto is_mark = [](const std::string& comment) { return comment.starts_with(kPartEnhancedMark); };
    std::ranges::copy_if(input.cloud.comments, std::back_inserter(marks_of_parts), is_mark);
    std::erase_if(input.cloud.comments, is_mark);
    input.partly_enhanced = !marks_of_parts.empty();
  }

  ANCHORSPLAT_ASSIGN_OR_RETURN(const SizedMethods sized, FindSizedMethods(plan, options));
  if (sized.any || options.clean) RecogniseKind(options, input, report);
  if (options.clean) ANCHORSPLAT_RETURN_IF_ERROR(Clean(options, input.cloud, report));
  const bool unknown_of_few = sized.any && IsUnknownOfFew(options, input.cloud, report.looks);
  if (sized.any) {
    ANCHORSPLAT_RETURN_IF_ERROR(ChooseWidths(plan, options, unknown_of_few, input, report));
  } else if (IsMarkedEnhanced(input.cloud)) {
    LogWarning("the splat says that it has been enhanced already; networks learn from splats that have not");
  }
  if (GivesWidth(input.filter_strength, options.upscale, input.cloud.render_mode)) {
    ChooseNetwork(options, unknown_of_few, plan, input, report);
  }
  report.method = plan.Name();

  if (report.pixel_size_source == kUnknownPixelSize) {
    report.filter_strength = 0;
    report.gaussians_out = input.cloud.size();
    report.seconds_in_all = in_all.Total();
    return Enhanced{std::move(input.cloud), std::move(report)};
  }

  LeaveIfAbandoned();
  const Stopwatch watch;
  EnhanceOptions within = options;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const GaussianCloud rest, SetRestAside(options, input, within, report));
  const bool sure_only = report.pixel_size_source == kCautiousPixelSize && TakesSureOnly(plan, input);
  ANCHORSPLAT_ASSIGN_OR_RETURN(GaussianCloud out, sure_only ? RunOnSure(plan, std::move(input), within, report)
                                                            : RunPlan(plan, sized, std::move(input), within, report));
  // Methods that make no copies, and what a region's border leaves of them.
  (void)LeaveOutLeastVisible(within.max_gaussians, out);
  if (options.region) ANCHORSPLAT_RETURN_IF_ERROR(Append(out, rest));
  report.seconds = watch.Total();
  report.seconds_in_all = in_all.Total();
  report.gaussians_out = out.size();
  out.comments.insert(out.comments.end(), marks_of_parts.begin(), marks_of_parts.end());
  if (!sized.any || GivesWidth(report.filter_strength, options.upscale, out.render_mode)) {
    std::string mark = options.region ? PartEnhancedComment(report.method, options.upscale)
                                      : EnhancedComment(report.method, options.upscale);
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
  if (options.cameras) from_origin.cameras = FromOrigin(*options.cameras, origin);
  if (options.region) from_origin.region = FromOrigin(*options.region, origin);
  ANCHORSPLAT_ASSIGN_OR_RETURN(Enhanced enhanced, EnhanceFromOrigin(std::move(cloud), from_origin));
  enhanced.cloud.origin = origin;
  enhanced.cloud.double_means = double_means;
  return enhanced;
}

}  // namespace anchorsplat
