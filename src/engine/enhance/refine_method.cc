#include "enhance/refine_method.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/log.h"
#include "core/text.h"
#include "enhance/enhance_region.h"
#include "enhance/enlarged_targets.h"
#include "enhance/filter.h"
#include "enhance/gaussian_budget.h"
#include "enhance/refine.h"
#include "fit/fitter.h"
#include "fit/pixel_model.h"

namespace anchorsplat {

namespace {

void AddFacts(const RefineReport& r, StepReport& report) {
  report.interrupted = r.interrupted;
  report.plan = r.plan;
  report.facts = {{"steps", r.steps},
                  {"resumed_at", r.resumed_at},
                  {"views", r.views},
                  {"consistency_before", r.before},
                  {"consistency_after", r.after},
                  {"k", int64_t{r.copies}},
                  {"kept_start", r.kept_start},
                  {"pruned", r.pruned},
                  {"seconds_load", r.times.load},
                  {"seconds_render", r.times.objective.render},
                  {"seconds_loss", r.times.objective.loss},
                  {"seconds_backward", r.times.objective.backward},
                  {"seconds_adam", r.times.adam}};
  if (r.input_psnr) report.facts.emplace_back("input_psnr", *r.input_psnr);
}

Result<GaussianCloud> RunRefine(EnhanceInput input, const EnhanceOptions& options, bool enlarged, StepReport& report) {
  if (options.upscale > kMostSamples) {
    return Error{ErrorCode::kBadArgument,
                 Cat("--upscale ", options.upscale, " is too much for refinement; the most is ", kMostSamples)};
  }
  RefineInput refine;
  refine.upscale = options.upscale;
  refine.pixel_size = input.pixel_size;
  refine.cameras = std::move(input.cameras);
  refine.times_larger = input.times_larger;
  refine.seed = options.seed;
  refine.start_has_detail = input.start_has_detail;
  refine.start = std::move(input.start);
  const int64_t inside = input.in_region.empty() ? input.cloud.size() : std::ranges::count(input.in_region, 1);
  if (refine.start.empty()) {
    EnhanceInput filtered;
    filtered.cloud = input.cloud;
    filtered.pixel_sizes = std::move(input.pixel_sizes);
    filtered.in_region = input.in_region;
    KeepOnlyRegion(filtered);
    input.pixel_sizes = std::move(filtered.pixel_sizes);
    refine.start = std::move(filtered.cloud);
    const auto grown =
        ApplyFilter(refine.start, input.pixel_sizes, {.upscale = options.upscale, .strength = input.filter_strength});
    if (!grown.ok()) return grown.error();
  }
  // At most what the closer view's own pixels add.
  const std::optional<RenderMode> mode = input.cloud.render_mode;
  const bool lost_none = input.filter_strength <= ShownStrength(options.upscale, mode);
  const bool invents = !options.refine.enlarge_with.empty();
  if ((lost_none || IsCompensated(mode)) && options.refine.images.empty() && !invents) {
    RefinePlan& plan = report.plan.emplace();
    plan.options = options.refine;
    plan.nothing_to_do = true;
    plan.why = lost_none ? "nothing to refine: the splat needs no sharpening. Pass its training pictures with --images"
                         : Cat("nothing to refine: ", NameOf(*mode),
                               " splats need their training pictures (--images). Keeping the ",
                               refine.start_has_detail ? "network's" : "filter's", " result");
    LogInfo(plan.why);
    report.facts.emplace_back("kept_start", true);
    return std::move(refine.start);
  }
  refine.fixed = input.cloud.size() - inside;
  refine.cloud = std::move(input.cloud);
  if (refine.fixed > 0) {
    // Fixed Gaussians come last in both clouds.
    std::vector<char> outside = input.in_region;
    for (char& flag : outside) flag = flag == 0 ? 1 : 0;
    GaussianCloud rest = refine.cloud;
    KeepMarked(outside, rest);
    KeepMarked(input.in_region, refine.cloud);
    ANCHORSPLAT_RETURN_IF_ERROR(Append(refine.cloud, rest));
    ANCHORSPLAT_RETURN_IF_ERROR(Append(refine.start, rest));
  }
  RefineOptions how = options.refine;
  how.enlarged = enlarged;
  if (options.background) how.background = options.background;
  ANCHORSPLAT_ASSIGN_OR_RETURN(Refined refined, Refine(std::move(refine), how, options.control));
  AddFacts(refined.report, report);
  if (invents) report.facts.emplace_back("invented", !refined.report.kept_start);
  return std::move(refined.cloud);
}

Result<GaussianCloud> RunPlain(EnhanceInput input, const EnhanceOptions& options, StepReport& report) {
  return RunRefine(std::move(input), options, false, report);
}
Result<GaussianCloud> RunEnlarged(EnhanceInput input, const EnhanceOptions& options, StepReport& report) {
  return RunRefine(std::move(input), options, true, report);
}

// Options that affect refinement, in both its methods.
std::vector<MethodOption> OptionsOfRefinement() {
  const auto filtered = [](const MethodUse& use) {
    return use.start == nullptr ? "" : "with a --method that uses the filter";
  };
  const auto beside_images = [filtered](const MethodUse& use) {
    return use.options.refine.images.empty() ? "" : filtered(use);
  };
  std::vector<MethodOption> options = WidthOptions(filtered);
  for (MethodOption& option : options) {
    if (option.name == "upscale") option.lacks = {};
    if (option.name == "cameras") option.lacks = beside_images;
    if (option.name == "pixel-size") {
      option.lacks = [=](const MethodUse& use) { return use.options.cameras ? filtered(use) : beside_images(use); };
    }
  }
  options.push_back({"background"});
  for (const auto& more : {RefinementOptions(), CheckpointOptions()}) {
    options.insert(options.end(), more.begin(), more.end());
  }
  return options;
}

std::vector<MethodOption> Without(const char* ending) {
  std::vector<MethodOption> options = OptionsOfRefinement();
  std::erase_if(options, [&](const MethodOption& option) { return option.name.ends_with(ending); });
  return options;
}

bool WithPictures(const EnhanceOptions& options) { return !options.refine.images.empty(); }

// Minimum; without --k it depends on the views.
int64_t Expected(int64_t count, const EnhanceOptions& options) {
  const int64_t wanted = count * options.refine.copies.value_or(1), most = options.refine.max_gaussians;
  return most > 0 ? std::min(wanted, most) : wanted;
}

}  // namespace

EnhanceMethod RefineMethod() {
  return {.name = "refine",
          .summary = "optimise against low-resolution renders of the splat, or --images; a minute",
          .rank = -1,  // never without being asked: it takes its time
          .takes_start = true,
          .starts_from_best = WithPictures,
          .is_checkpoint = IsFitCheckpoint,
          .options = Without("enlarge-with"),
          .expected_gaussians = Expected,
          .ready = [](const EnhanceOptions& options) { return Validate(options.refine); },
          .run = RunPlain};
}

bool CanEnlarge(double upscale) { return upscale >= 1 && upscale <= kMostSamples && upscale == std::floor(upscale); }

namespace {

// Also reads the network file, so that errors appear before any work.
Status CheckDetail(const EnhanceOptions& options) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(options.refine));
  if (!CanEnlarge(options.upscale)) {
    return Error{ErrorCode::kBadArgument, Cat("--upscale ", options.upscale,
                                              ": the method 'detail' needs a whole number from 1 to ", kMostSamples)};
  }
  if (options.refine.enlarge_with.empty()) return {};
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Upscaler network, Upscaler::Read(options.refine.enlarge_with));
  return CheckFactor(static_cast<int>(options.upscale), network.info().scale);
}

}  // namespace

EnhanceMethod DetailMethod() {
  return {.name = "detail",
          .summary =
              "refine against views at the closer view's resolution; minutes. With --enlarge-with it invents "
              "detail",
          .rank = -1,
          .takes_start = true,
          .starts_from_best = [](const EnhanceOptions&) { return true; },
          .invents = [](const EnhanceOptions& options) { return !options.refine.enlarge_with.empty(); },
          .is_checkpoint = IsFitCheckpoint,
          .options = Without("-from"),  // uses all rays
          .expected_gaussians = Expected,
          .ready = CheckDetail,
          .run = RunEnlarged};
}

EnhanceMethod RefineImagesMethod() {
  return {.name = "refine-images",
          .summary = "refine against --images",
          .rank = 2,
          .takes_start = true,
          .starts_from_best = WithPictures,
          .is_checkpoint = IsFitCheckpoint,
          .options = Without("enlarge-with"),
          .expected_gaussians = Expected,
          .ready = [](const EnhanceOptions& options) -> Status {
            if (!options.refine.images.empty()) return Validate(options.refine);
            return Error{ErrorCode::kBadArgument, "the method 'refine-images' needs --images PROJECT"};
          },
          .run = RunPlain};
}

}  // namespace anchorsplat
