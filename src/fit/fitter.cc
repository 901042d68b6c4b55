#include "fit/fitter.h"

#include <utility>
#include <vector>

#include "core/stopwatch.h"
#include "metrics/image_metrics.h"

namespace anchorsplat {

Result<Fitter> Fitter::Begin(const FitOptions& options, PictureCache pictures, double scene_scale, FitState state) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(options));
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(state.cloud));
  if (pictures.views().empty()) return Error{ErrorCode::kBadArgument, "fit: there are no views to train on"};
  if (state.cloud.empty()) return Error{ErrorCode::kBadArgument, "fit: there are no Gaussians to begin with"};
  return Fitter(options, std::move(pictures), scene_scale, std::move(state));
}

FitState Fitter::Fresh(GaussianCloud cloud) {
  FitState state;
  state.optimizer = CloudOptimizer(cloud);
  state.densification = Densification(cloud.size());
  state.cloud = std::move(cloud);
  return state;
}

Fitter::Fitter(const FitOptions& options, PictureCache pictures, double scene_scale, FitState state)
    : options_(options),
      pictures_(std::move(pictures)),
      scene_scale_(scene_scale),
      state_(std::move(state)),
      order_(static_cast<int64_t>(pictures_.views().size()), options.seed) {}

Result<FitStep> Fitter::Step() {
  Stopwatch watch;
  const int64_t step = state_.step;
  const int degree = ShDegreeAt(options_, step);
  FitStep out;
  out.view = order_.At(step);
  const Camera& camera = pictures_.views()[static_cast<size_t>(out.view)];
  ANCHORSPLAT_RETURN_IF_ERROR(pictures_.Load(out.view, picture_));
  times_.load += watch.Lap();

  ObjectiveOptions objective = options_.objective;
  objective.render.sh_degree = degree;
  objective.pixel = PixelModelAt(options_, step);
  ANCHORSPLAT_ASSIGN_OR_RETURN(out.loss, objective_.Evaluate(objective, state_.cloud, camera, picture_, gradient_));
  watch.Lap();
  const double means_rate = MeansRate(options_.rates, scene_scale_, step, options_.steps);
  state_.optimizer.Step(options_.rates, means_rate, degree, gradient_, state_.cloud);
  times_.adam += watch.Lap();

  const Pinhole rays = RaysOf(objective.pixel, camera).intrinsics;
  out.change = state_.densification.AfterStep(options_.densification, step, scene_scale_, options_.seed, rays.width,
                                              rays.height, gradient_, state_.cloud);
  state_.optimizer.Apply(out.change.rows);
  if (out.change.opacities_reset) state_.optimizer.ForgetOpacities();
  times_.densify += watch.Lap();
  ++state_.step;
  if (state_.cloud.empty()) {
    return Error{ErrorCode::kBadArgument,
                 "fit: pruning has left no Gaussian; do the pictures show anything but background?"};
  }
  return out;
}

FitTimes Fitter::times() const {
  FitTimes times = times_;
  times.objective = objective_.times();
  return times;
}

double Fitter::LastPsnr() const {
  const auto psnr = Psnr(objective_.rendered(), picture_);
  return psnr.ok() ? *psnr : 0;
}

GaussianCloud Fitter::UsableCloud() const {
  const GaussianCloud& cloud = state_.cloud;
  std::vector<int64_t> usable;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (IsUsable(cloud, i)) usable.push_back(i);
  }
  if (static_cast<int64_t>(usable.size()) == cloud.size()) return cloud;
  return Subset(cloud, usable).value();
}

}  // namespace anchorsplat
