#include "enhance/enhance.h"

#include <anchorsplat/enhance.h>

#include "api/bridge.h"
#include "core/region.h"
#include "core/text.h"
#include "enhance/gaussian_budget.h"
#include "model/model_method.h"

namespace anchorsplat {

namespace {

Result<EnhanceOptions> ToOptions(const EnhanceSettings& settings) {
  EnhanceOptions options;
  const auto given = [&](bool is_given, const char* name) {
    if (is_given) options.given.emplace_back(name);
  };
  options.methods = &AllMethods();
  options.method = settings.method;
  options.quality = settings.quality;
  options.upscale = settings.upscale;
  options.filter_strength = settings.filter_strength;
  options.pixel_size = settings.pixel_size;
  options.mode = ToMode(settings.rasterization);
  options.refine.images = settings.images;
  options.refine.enlarge_with = settings.enlarge_with;
  options.model.file = settings.model;
  options.model.copies = settings.copies;
  SetBudget(options, settings.max_gaussians);
  options.seed = settings.seed;
  given(settings.upscale != EnhanceSettings().upscale, "upscale");
  given(settings.filter_strength.has_value(), "filter-strength");
  given(settings.pixel_size.has_value(), "pixel-size");
  given(settings.rasterization.has_value(), "mode");
  given(!settings.cameras.empty(), "cameras");
  given(!settings.images.empty(), "images");
  given(!settings.enlarge_with.empty(), "enlarge-with");
  given(!settings.model.empty(), "model");
  given(settings.copies.has_value(), "copies");
  given(settings.max_gaussians != 0, "max-gaussians");
  given(!settings.region.empty(), "region");
  if (!settings.region.empty()) {
    options.region = RegionOf(settings.region);
    if (!options.region) {
      std::string numbers;
      for (const double x : settings.region) numbers += Cat(numbers.empty() ? "" : ",", x);
      return Error{ErrorCode::kBadArgument, Cat("region: '", numbers, "'", kNoRegion)};
    }
  }
  if (!settings.cameras.empty()) {
    options.cameras.emplace();
    for (const PinholeCamera& camera : settings.cameras) options.cameras->cameras.push_back(ToCamera(camera));
  }
  for (const auto& [name, value] : settings.refine) {
    ANCHORSPLAT_RETURN_IF_ERROR(SetOption(RefinementOptions(), name, value, options));
  }
  SetBudget(options, options.max_gaussians);  // one budget, wherever it was set
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(options.refine));
  return options;
}

Result<EnhanceOutcome> RunMethod(GaussianCloud cloud, const EnhanceSettings& settings) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const EnhanceOptions options, ToOptions(settings));
  ANCHORSPLAT_ASSIGN_OR_RETURN(Enhanced enhanced, Enhance(std::move(cloud), options));
  EnhanceReport& report = enhanced.report;
  EnhanceOutcome outcome{.splat = SplatAccess::Make(std::move(enhanced.cloud)),
                         .method = std::move(report.method),
                         .gaussians_in = report.gaussians_in,
                         .dropped = report.dropped,
                         .gaussians_out = report.gaussians_out,
                         .kept_outside = report.kept_outside,
                         .filter_strength = report.filter_strength,
                         .pixel_size = report.pixel_size,
                         .pixel_size_source = std::string(NameOf(report.pixel_size_source)),
                         .steps = {},
                         .stopped = report.interrupted,
                         .seconds = report.seconds};
  for (StepReport& step : report.steps) {
    outcome.steps.push_back({std::move(step.method), step.dropped, step.interrupted, std::move(step.facts)});
  }
  return outcome;
}

}  // namespace

std::vector<EnhanceMethodName> ListEnhanceMethods() {
  std::vector<EnhanceMethodName> names;
  for (const EnhanceMethod& method : AllMethods()) names.push_back({method.name, method.summary});
  return names;
}

Expected<EnhanceOutcome> Enhance(const SplatView& splat, const EnhanceSettings& settings, const RunSettings& run) {
  return InRun<EnhanceOutcome>(run, [&]() -> Result<EnhanceOutcome> {
    ANCHORSPLAT_RETURN_IF_ERROR(Validate(ToCloud(splat)));
    return RunMethod(CopyOf(ToCloud(splat)), settings);
  });
}

Expected<EnhanceOutcome> Enhance(Splat&& splat, const EnhanceSettings& settings, const RunSettings& run) {
  return InRun<EnhanceOutcome>(run, [&] { return RunMethod(SplatAccess::Take(std::move(splat)), settings); });
}

}  // namespace anchorsplat
