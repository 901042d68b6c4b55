#include "fit/fit.h"

#include <anchorsplat/fit.h>

#include <string_view>

#include "api/bridge.h"
#include "cameras/photograph.h"
#include "core/text.h"
#include "fit/checkpoint_guard.h"
#include "fit/far_shell.h"
#include "fit/initial_cloud.h"
#include "fit/initial_points.h"
#include "fit/training_views.h"

namespace anchorsplat {

namespace {

FitPreset PresetOf(FitStrategy strategy) {
  switch (strategy) {
    case FitStrategy::kAbsgrad:
      return FitPreset::kAbsgrad;
    case FitStrategy::kMcmc:
      return FitPreset::kMcmc;
    default:
      return FitPreset::kDefault;
  }
}

FitInit InitOf(StartingPoints points) {
  switch (points) {
    case StartingPoints::kProject:
      return FitInit::kPoints;
    case StartingPoints::kView:
      return FitInit::kView;
    case StartingPoints::kRandom:
      return FitInit::kRandom;
    default:
      return FitInit::kAuto;
  }
}

FitQuality ToQuality(const ViewQuality& quality) { return {quality.views, quality.psnr, quality.ssim}; }

Result<FitOutcome> FitTo(const std::filesystem::path& project, const GaussianCloud* start,
                         const FitSettings& settings) {
  if (settings.sh_degree < 0 || settings.sh_degree > kMaxShDegree) {
    return Error{ErrorCode::kBadArgument, "the SH degree of a fit must be 0 to 3"};
  }
  if (settings.steps < 1 || settings.max_gaussians < 0 || settings.hold_out < 0 ||
      settings.initial_points.value_or(1) < 1) {
    return Error{ErrorCode::kBadArgument,
                 "a fit needs at least one step and one Gaussian; max_gaussians and hold_out must not be negative"};
  }
  if (const auto extent = settings.initial_extent) {
    if (!(*extent >= 1e-3 && *extent <= 1e3)) {
      return Error{ErrorCode::kBadArgument, Cat("the initial extent ", *extent, " is not in 0.001 to 1000")};
    }
    if (start != nullptr || settings.starting_points != StartingPoints::kRandom) {
      return Error{ErrorCode::kBadArgument, "an initial extent has no effect without StartingPoints::kRandom"};
    }
  }
  if (settings.downscale < 1 || settings.downscale > kMaxDownscale) {
    return Error{ErrorCode::kBadArgument, Cat("the downscale of a fit must be 1 to ", kMaxDownscale)};
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const TrainingViews views,
                               OpenProject(project, {.hold_out = settings.hold_out, .downscale = settings.downscale}));
  FitOptions options = FitOptionsFor(settings.steps, PresetOf(settings.strategy));
  options.seed = settings.seed;
  options.densification.max_gaussians = settings.max_gaussians;
  if (settings.max_gaussians > 0) options.mcmc.cap_max = settings.max_gaussians;
  options.objective.render.mode = *ToMode(settings.rasterization);
  options.pixel.upscale = settings.area_pixels;
  if (settings.mip_filter) UseMipFilter(options);
  if (settings.exposure) options.exposure_from = ExposureFrom(settings.steps);
  options.objective.render.sh_degree = settings.sh_degree;
  if (const auto background = settings.background ? settings.background : views.background) {
    options.objective.render.background = *background;
  }
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(options));
  InitialPoints points;
  if (start != nullptr) {
    points = SubsampleEvenly(PointsOf(*start, views.origin), settings.initial_points);
  } else {
    ANCHORSPLAT_ASSIGN_OR_RETURN(
        points, InitialPointsOf(InitOf(settings.starting_points), views, settings.initial_points, settings.seed,
                                settings.initial_extent.value_or(kRandomExtent)));
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(GaussianCloud initial, InitialCloud(points, views.scene_scale, StartOptions(options)));
  const bool from_points =
      start == nullptr && std::string_view(NameOf(InitOf(settings.starting_points), views)) == "points";
  const auto shell = AddFarShell(views, points, settings.far_shell, from_points, options, initial);
  if (!shell.ok()) return shell.error();
  FitControl control;
  control.checkpoint = settings.checkpoint;
  control.resume = settings.resume;
  if (!control.checkpoint.empty()) {
    ANCHORSPLAT_RETURN_IF_ERROR(CheckCheckpoint(control.checkpoint, {}, control.resume, /*overwrite=*/false));
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const auto lock, HoldCheckpoint(control.checkpoint));
  ANCHORSPLAT_ASSIGN_OR_RETURN(Fitted fitted, Fit(views, std::move(initial), options, control));
  const FitReport& report = fitted.report;
  return FitOutcome{.splat = SplatAccess::Make(std::move(fitted.cloud)),
                    .steps = report.steps,
                    .stopped = report.interrupted,
                    .gaussians_in = report.gaussians_in,
                    .train = ToQuality(report.train),
                    .held_out = ToQuality(report.held_out),
                    .seconds = report.seconds};
}

}  // namespace

Expected<FitOutcome> FitProject(const std::filesystem::path& project, const FitSettings& settings,
                                const RunSettings& run) {
  return InRun<FitOutcome>(run, [&] { return FitTo(project, nullptr, settings); });
}

Expected<FitOutcome> FitProject(const std::filesystem::path& project, const SplatView& start,
                                const FitSettings& settings, const RunSettings& run) {
  return InRun<FitOutcome>(run, [&]() -> Result<FitOutcome> {
    ANCHORSPLAT_RETURN_IF_ERROR(Validate(ToCloud(start)));
    const GaussianCloud cloud = CopyOf(ToCloud(start));
    return FitTo(project, &cloud, settings);
  });
}

}  // namespace anchorsplat
