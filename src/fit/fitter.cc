#include "fit/fitter.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "core/most_visible.h"
#include "core/stopwatch.h"
#include "fit/exposure_per_view.h"
#include "metrics/image_metrics.h"

namespace anchorsplat {

Result<Fitter> Fitter::Begin(const FitOptions& options, PictureCache pictures, double scene_scale, FitState state) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(options));
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(state.cloud));
  if (pictures.views().empty()) return Error{ErrorCode::kBadArgument, "fit: there are no views to train on"};
  if (state.cloud.empty()) return Error{ErrorCode::kBadArgument, "fit: there are no Gaussians to begin with"};
  const auto n = static_cast<size_t>(state.cloud.size());
  if (options.strategy == Strategy::kDefault && state.densification.gathered().count.size() != n) {
    return Error{ErrorCode::kBadArgument, "fit: the state is that of a strategy which gathers nothing"};
  }
  if (options.mip_filter && state.step > 0 && state.mip_filter.size() != n) {
    return Error{ErrorCode::kBadArgument, "fit: the state is that of a fit without a smoothing filter"};
  }
  const size_t exposures = options.exposure_from < 0 || state.step == 0 ? 0 : 6 * pictures.views().size();
  if (state.exposures.size() != exposures) {
    return Error{ErrorCode::kBadArgument, "fit: the state is that of a fit with other exposures of its views"};
  }
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
      order_(static_cast<int64_t>(pictures_.views().size()), options.seed) {
  if (options_.strategy == Strategy::kMcmc) state_.densification = Densification();
  if (options_.mip_filter && state_.step == 0) MeasureMipFilter();
  if (options_.exposure_from >= 0 && state_.exposures.empty())
    state_.exposures = NoExposures(static_cast<int64_t>(pictures_.views().size()));
}

Result<FitStep> Fitter::Step() {
  Stopwatch watch;
  const int64_t step = state_.step;
  const int degree = ShDegreeAt(options_, step);
  FitStep out;
  out.view = order_.At(step);
  const Camera& camera = pictures_.views()[static_cast<size_t>(out.view)];
  pictures_.LoadAhead(order_.From(step));
  ANCHORSPLAT_RETURN_IF_ERROR(pictures_.Load(out.view, picture_, ignored_));
  times_.load += watch.Lap();

  ObjectiveOptions objective = options_.objective;
  objective.render.sh_degree = degree;
  objective.pixel = PixelModelAt(options_, step);
  objective.render.absgrad = options_.strategy == Strategy::kDefault && options_.densification.absgrad;
  const CloudView shown = options_.mip_filter ? filtered_.Of(state_.cloud, state_.mip_filter) : CloudView(state_.cloud);
  ANCHORSPLAT_RETURN_IF_ERROR(objective_.Show(objective, shown, camera));
  FillIgnored(ignored_, objective_.rendered(), picture_);
  if (options_.exposure_from >= 0 && step >= options_.exposure_from) {
    ANCHORSPLAT_RETURN_IF_ERROR(FollowExposure(objective_.rendered(), out.view, picture_, state_.exposures));
  }
  const CoefficientStep coefficients = state_.optimizer.BeginStep(options_.rates, degree, state_.cloud);
  ANCHORSPLAT_ASSIGN_OR_RETURN(out.loss, objective_.Compare(objective, shown, picture_, gradient_, &coefficients));
  watch.Lap();
  if (options_.mip_filter) MipFilterBackward(state_.cloud, state_.mip_filter, gradient_);
  AddRegularizers(options_.regularizers, UnitOf(scene_scale_), options_.far, state_.cloud, gradient_);
  const double means_rate = MeansRate(options_.rates, scene_scale_, step, options_.steps);
  state_.optimizer.FinishStep(options_.rates, means_rate, gradient_, state_.cloud, options_.far);
  times_.adam += watch.Lap();

  out.change = ChangeGaussians(RaysOf(objective.pixel, camera));
  times_.densify += watch.Lap();
  ++state_.step;
  if (state_.cloud.empty()) {
    return Error{ErrorCode::kBadArgument,
                 "fit: pruning has left no Gaussian; do the pictures show anything but background?"};
  }
  return out;
}

DensificationChange Fitter::ChangeGaussians(const Camera& rays) {
  const int64_t step = state_.step;
  DensificationChange change;
  if (options_.strategy == Strategy::kMcmc) {
    // The trainer steps its schedule before its strategy: the rate is that of the next step.
    change = McmcAfterStep(options_.mcmc,
                           {.step = step,
                            .means_rate = MeansRate(options_.rates, scene_scale_, step + 1, options_.steps),
                            .unit = UnitOf(scene_scale_),
                            .seed = options_.seed,
                            .far = options_.far},
                           state_.cloud);
  } else {
    change =
        state_.densification.AfterStep(options_.densification, step, scene_scale_, options_.seed, rays.intrinsics.width,
                                       rays.intrinsics.height, gradient_, state_.cloud, options_.far);
  }
  KeepToBudget(step, change);
  state_.optimizer.ForgetRows(change.forgotten);
  state_.optimizer.Apply(change.rows);
  if (options_.mip_filter) {
    const int64_t done = step + 1;
    const bool due = done % options_.mip_filter_every == 0 && done < options_.steps - options_.mip_filter_every;
    if (due || change.rows.any || change.relocated > 0) MeasureMipFilter();
  }
  if (change.resets_opacities) {
    const double cap = 2 * options_.densification.prune_opa;
    if (options_.mip_filter) {
      CapFilteredOpacities(state_.mip_filter, cap, state_.cloud);
    } else {
      CapOpacities(state_.cloud, cap);
    }
    state_.optimizer.ForgetOpacities();
  }
  return change;
}

void Fitter::KeepToBudget(int64_t step, DensificationChange& change) {
  const bool mcmc = options_.strategy == Strategy::kMcmc;
  const int64_t most = mcmc ? options_.mcmc.cap_max : options_.densification.max_gaussians;
  const int64_t stop = mcmc ? options_.mcmc.refine_stop_iter : options_.densification.refine_stop_iter;
  if (most <= 0 || state_.cloud.size() <= most) return;
  if (step != std::min(stop, options_.steps - 1) || change.rows.any) return;
  change.rows.kept.clear();
  for (const int64_t row : MostVisible(state_.cloud, most)) change.rows.kept.push_back(row);
  change.rows.any = true;
  change.pruned += state_.cloud.size() - most;
  state_.cloud = Subset(state_.cloud, change.rows.kept).value();
  if (!mcmc) state_.densification = Densification(most);
}

void Fitter::MeasureMipFilter() {
  state_.mip_filter = MipFilterSizes(state_.cloud.means, pictures_.views(), options_.objective.render.near_plane);
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
  GaussianCloud cloud = state_.cloud;
  if (options_.mip_filter) FuseMipFilter(state_.mip_filter, cloud);
  std::vector<int64_t> usable;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (IsUsable(cloud, i)) usable.push_back(i);
  }
  if (static_cast<int64_t>(usable.size()) == cloud.size()) return cloud;
  return Subset(cloud, usable).value();
}

}  // namespace anchorsplat
