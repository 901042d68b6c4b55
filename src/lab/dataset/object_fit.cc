#include "dataset/object_fit.h"

#include "fit/initial_cloud.h"

namespace anchorsplat {

Result<FitOptions> ToFitOptions(const ObjectSettings& settings, double upscale,
                                const std::array<float, 3>& background) {
  FitOptions options = FitOptionsFor(settings.fit_steps, settings.strategy);
  options.seed = settings.seed;
  options.densification.max_gaussians = settings.max_gaussians;
  options.objective.render.background = background;
  options.objective.render.sh_degree = settings.sh_degree;
  options.objective.render.mode = settings.mode;
  options.pixel.upscale = settings.pixel_area ? upscale : 1;
  if (options.strategy == Strategy::kMcmc) options.mcmc.cap_max = settings.max_gaussians;
  if (settings.mip_filter) UseMipFilter(options);
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(options));
  return options;
}

Result<GaussianCloud> InitialCloudOf(const ObjectSettings& settings, const FitOptions& options,
                                     const TrainingViews& views) {
  const int64_t count = settings.init_points > 0 ? settings.init_points : kRandomPoints;
  const InitialCloudOptions start = StartOptions(options);
  switch (settings.start) {
    case FitStart::kRandom:
      return InitialCloud(RandomPoints(count, views.scene_scale, settings.seed, settings.init_extent),
                          views.scene_scale, start);
    case FitStart::kView:
      return InitialCloud(RandomPointsInView(count, views.train, views.scene_scale, settings.seed), views.scene_scale,
                          start);
    case FitStart::kSurface:
      break;
  }
  return InitialCloud(views.points, views.scene_scale, start);
}

}  // namespace anchorsplat
