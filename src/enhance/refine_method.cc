#include "enhance/refine_method.h"

#include <algorithm>
#include <utility>

#include "core/log.h"
#include "core/text.h"
#include "enhance/filter.h"
#include "enhance/refine.h"
#include "fit/pixel_model.h"

namespace anchorsplat {

namespace {

void AddFacts(const RefineReport& r, EnhanceReport& report) {
  report.interrupted = r.interrupted;
  report.facts.insert(report.facts.end(), {{"steps", static_cast<double>(r.steps)},
                                           {"resumed_at", static_cast<double>(r.resumed_at)},
                                           {"views", static_cast<double>(r.views)},
                                           {"consistency_before", r.before},
                                           {"consistency_after", r.after},
                                           {"kept_start", r.kept_start ? 1.0 : 0.0},
                                           {"pruned", static_cast<double>(r.pruned)},
                                           {"seconds_load", r.times.load},
                                           {"seconds_render", r.times.objective.render},
                                           {"seconds_loss", r.times.objective.loss},
                                           {"seconds_backward", r.times.objective.backward},
                                           {"seconds_adam", r.times.adam}});
  if (r.input_psnr) report.facts.emplace_back("input_psnr", *r.input_psnr);
}

Result<GaussianCloud> RunRefine(EnhanceInput input, const EnhanceOptions& options, EnhanceReport& report) {
  if (options.upscale > kMostSamples) {
    return Error{ErrorCode::kBadArgument, Cat("--upscale ", options.upscale,
                                              ": refinement renders that many rays per "
                                              "pixel and side and goes up to ",
                                              kMostSamples)};
  }
  RefineInput refine;
  refine.upscale = options.upscale;
  refine.pixel_size = report.pixel_size;
  refine.cameras = options.cameras;
  refine.seed = options.seed;
  const bool begun = !input.start.empty();
  if (begun) {
    refine.start = std::move(input.start);
  } else {
    refine.start = input.cloud;
    ANCHORSPLAT_ASSIGN_OR_RETURN(
        const int64_t grown,
        ApplyFilter(refine.start, input.pixel_sizes, {.upscale = options.upscale, .strength = input.filter_strength}));
    if (grown == 0 && options.refine.images.empty()) {
      LogInfo("there is no lost width to give back, and without pictures nothing else to learn: the splat stays");
      report.facts.emplace_back("kept_start", 1.0);
      return std::move(refine.start);
    }
  }
  refine.cloud = std::move(input.cloud);
  ANCHORSPLAT_ASSIGN_OR_RETURN(Refined refined, Refine(std::move(refine), options.refine, options.control));
  AddFacts(refined.report, report);
  return std::move(refined.cloud);
}

}  // namespace

EnhanceMethod RefineMethod() {
  return {.name = "refine",
          .summary = "a minute of optimisation against what the splat shows at low resolution, or --images",
          .rank = -1,  // never without being asked: it takes its time
          .takes_start = true,
          .ready = [](const EnhanceOptions& options) { return Validate(options.refine); },
          .run = RunRefine};
}

EnhanceMethod RefineImagesMethod() {
  return {.name = "refine-images",
          .summary = "refine with the pictures of --images",
          .rank = 2,
          .takes_start = true,
          .ready = [](const EnhanceOptions& options) -> Status {
            if (!options.refine.images.empty()) return Validate(options.refine);
            return Error{ErrorCode::kBadArgument, "the method 'refine-images' needs pictures: --images PROJECT"};
          },
          .run = RunRefine};
}

}  // namespace anchorsplat
