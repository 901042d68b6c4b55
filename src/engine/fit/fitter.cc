#include "fit/fitter.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "core/most_visible.h"
#include "core/stopwatch.h"
#include "core/text.h"
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
    return Error{ErrorCode::kBadArgument, "fit: the state lacks densification statistics: it is from another strategy"};
  }
  if (options.mip_filter && state.step > 0 && state.mip_filter.size() != n) {
    return Error{ErrorCode::kBadArgument, "fit: the state is from a fit without the Mip-Splatting filter"};
  }
  const size_t exposures = options.exposure_from < 0 || state.step == 0 ? 0 : 6 * pictures.views().size();
  if (state.exposures.size() != exposures) {
    return Error{ErrorCode::kBadArgument, "fit: the state is from a fit with other view exposures"};
  }
  Fitter fitter(options, std::move(pictures), scene_scale, std::move(state));
  if (fitter.CanReside() && !fitter.done()) fitter.residence_.MoveToGpu(fitter.state_);
  return fitter;
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
      order_(static_cast<int64_t>(pictures_.views().size()), options.seed),
      last_loss_(std::numeric_limits<double>::quiet_NaN()) {
  if (options_.strategy == Strategy::kMcmc) state_.densification = Densification();
  if (options_.mip_filter && state_.step == 0) MeasureMipFilter();
  if (options_.exposure_from >= 0 && state_.exposures.empty())
    state_.exposures = NoExposures(static_cast<int64_t>(pictures_.views().size()));
}

bool Fitter::CanReside() const {
  const Regularizers& r = options_.regularizers;
  return options_.strategy == Strategy::kDefault && !options_.mip_filter && !options_.far.any() && r.opacity_reg == 0 &&
         r.scale_reg == 0;
}

int64_t Fitter::size() const {
  return residence_.resident() != nullptr ? residence_.resident()->size() : state_.cloud.size();
}

const FitState& Fitter::state() {
  if (residence_.resident() != nullptr) {
    if (const Status copied = residence_.CopyToHost(state_); !copied.ok())
      residence_.MoveToHost(state_, copied.error());
  }
  return state_;
}

Result<FitStep> Fitter::Step() {
  Stopwatch watch;
  const int64_t step = state_.step;
  FitStep out;
  out.view = order_.At(step);
  const Camera& camera = pictures_.views()[static_cast<size_t>(out.view)];
  ResidentFit* away = residence_.resident();
  if (away == nullptr || FollowsExposure()) {
    pictures_.LoadAhead(order_.From(step));
    ANCHORSPLAT_RETURN_IF_ERROR(pictures_.Load(out.view, picture_, ignored_));
  } else if (!away->objective().Holds(out.view)) {
    pictures_.LoadAhead(order_.From(step));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const PackedPicture packed, pictures_.LoadPacked(out.view));
    const Status set = away->objective().SetTarget(packed, pictures_.background(), out.view);
    if (!set.ok()) {
      residence_.MoveToHost(state_, set.error());
      return Step();
    }
  }
  times_.load += watch.Lap();

  ObjectiveOptions objective = options_.objective;
  objective.render.sh_degree = ShDegreeAt(options_, step);
  objective.pixel = PixelModelAt(options_, step);
  objective.render.absgrad = options_.strategy == Strategy::kDefault && options_.densification.absgrad;
  const Camera rays = RaysOf(objective.pixel, camera);
  if (away != nullptr) {
    if (const Status learned = LearnOnGpu(objective, camera, out.view); !learned.ok()) {
      residence_.MoveToHost(state_, learned.error());
      return Step();
    }
  } else {
    ANCHORSPLAT_RETURN_IF_ERROR(Learn(objective, camera, out.view));
  }

  watch.Lap();
  if (away != nullptr) {
    Result<DensificationChange> change = ChangeOnGpu(rays);
    if (!change.ok()) {
      // The state is one densification behind, or older if the GPU was lost.
      if (!residence_.MoveToHost(state_, change.error())) return Step();
      change = ChangeGaussians(rays, nullptr);
    }
    out.change = std::move(change).value();
  } else {
    out.change = ChangeGaussians(rays, &gradient_);
  }
  times_.densify += watch.Lap();
  ++state_.step;
  if (size() == 0) {
    return Error{ErrorCode::kBadArgument,
                 "fit: pruning removed every Gaussian; check that the pictures show more than background"};
  }
  if (residence_.resident() != nullptr && done()) {
    LastPsnr();
    const Status home = residence_.MoveToHost(state_);
    if (!home.ok()) residence_.MoveToHost(state_, home.error());
  } else if (residence_.resident() != nullptr && Residence::IsCopyDue(state_.step)) {
    state();
  }
  return out;
}

Status Fitter::Learn(const ObjectiveOptions& objective, const Camera& camera, int64_t view) {
  const int64_t step = state_.step;
  const CloudView shown = options_.mip_filter ? filtered_.Of(state_.cloud, state_.mip_filter) : CloudView(state_.cloud);
  ANCHORSPLAT_RETURN_IF_ERROR(objective_.Show(objective, shown, camera));
  FillIgnored(ignored_, objective_.rendered(), picture_);
  if (FollowsExposure()) {
    ANCHORSPLAT_RETURN_IF_ERROR(FollowExposure(objective_.rendered(), view, picture_, state_.exposures));
  }
  const CoefficientStep coefficients =
      state_.optimizer.BeginStep(options_.rates, objective.render.sh_degree, state_.cloud);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const PhotometricLossValue loss,
                               objective_.Compare(objective, shown, picture_, gradient_, &coefficients));
  last_loss_ = loss.loss;
  Stopwatch watch;
  if (options_.mip_filter) MipFilterBackward(state_.cloud, state_.mip_filter, gradient_);
  AddRegularizers(options_.regularizers, UnitOf(scene_scale_), options_.far, state_.cloud, gradient_);
  const double means_rate = MeansRate(options_.rates, scene_scale_, step, options_.steps);
  state_.optimizer.FinishStep(options_.rates, means_rate, gradient_, state_.cloud, options_.far);
  times_.adam += watch.Lap();
  return {};
}

Status Fitter::LearnOnGpu(const ObjectiveOptions& objective, const Camera& camera, int64_t view) {
  Stopwatch watch;
  ResidentFit& fit = *residence_.resident();
  GpuObjective& shown = fit.objective();
  ANCHORSPLAT_ASSIGN_OR_RETURN(const bool drawn, fit.Show(objective, camera));
  if (!drawn)
    return Error{ErrorCode::kBadArgument,
                 Cat("camera ", camera.name, " needs more precision than a GPU's 32-bit floats")};
  int64_t compared = view;
  if (FollowsExposure()) {
    compared = -1;  // an adjusted picture must not be cached
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Image* rendered, shown.Rendered());
    FillIgnored(ignored_, *rendered, picture_);
    ANCHORSPLAT_RETURN_IF_ERROR(FollowExposure(*rendered, view, picture_, state_.exposures));
    ANCHORSPLAT_RETURN_IF_ERROR(shown.SetTarget(picture_, ignored_));
  }
  gpu_times_.render += watch.Lap();
  const Camera rays = RaysOf(objective.pixel, camera);
  ANCHORSPLAT_RETURN_IF_ERROR(
      fit.Learn(objective, compared,
                {.rates = options_.rates,
                 .means_rate = MeansRate(options_.rates, scene_scale_, state_.step, options_.steps),
                 .sh_degree = objective.render.sh_degree,
                 .number = state_.step + 1,
                 .gathers = Densification::Gathers(options_.densification, state_.step),
                 .absgrad = options_.densification.absgrad,
                 .width = rays.intrinsics.width,
                 .height = rays.intrinsics.height}));
  residence_.CountStep();
  gpu_times_.backward += watch.Lap();
  return {};
}

Result<DensificationChange> Fitter::ChangeOnGpu(const Camera& rays) {
  const int64_t step = state_.step;
  const DensificationOptions& how = options_.densification;
  ResidentFit& fit = *residence_.resident();
  const auto on_host = [&]() -> Result<DensificationChange> {
    ANCHORSPLAT_RETURN_IF_ERROR(residence_.MoveToHost(state_));
    DensificationChange change = ChangeGaussians(rays, nullptr);
    if (state_.cloud.empty()) return change;
    ++state_.step;  // the copy is of this step
    residence_.MoveToGpu(state_);
    --state_.step;
    return change;
  };
  if (CutsToBudget(step)) return on_host();
  DensificationChange change;
  if (Densification::Refines(how, step)) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(RefinementPlan plan, fit.Plan(how, step, scene_scale_, options_.seed));
    if (plan.change.rows.kept.empty() && plan.change.rows.fresh == 0) return on_host();
    ANCHORSPLAT_RETURN_IF_ERROR(fit.Apply(how, plan));
    change = std::move(plan.change);
  }
  change.resets_opacities = Densification::ResetsOpacities(how, step);
  if (change.resets_opacities) fit.ResetOpacities(2 * how.prune_opa);
  return change;
}

DensificationChange Fitter::ChangeGaussians(const Camera& rays, const CloudGradient* gradient) {
  const int64_t step = state_.step;
  DensificationChange change;
  if (options_.strategy == Strategy::kMcmc) {
    // gsplat's trainer advances its schedule before the strategy, so this is the next step's rate.
    change = McmcAfterStep(options_.mcmc,
                           {.step = step,
                            .means_rate = MeansRate(options_.rates, scene_scale_, step + 1, options_.steps),
                            .unit = UnitOf(scene_scale_),
                            .seed = options_.seed,
                            .far = options_.far},
                           state_.cloud);
  } else if (gradient != nullptr) {
    change =
        state_.densification.AfterStep(options_.densification, step, scene_scale_, options_.seed, rays.intrinsics.width,
                                       rays.intrinsics.height, *gradient, state_.cloud, options_.far);
  } else {
    change = state_.densification.AfterGathering(options_.densification, step, scene_scale_, options_.seed,
                                                 state_.cloud, options_.far);
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

bool Fitter::CutsToBudget(int64_t step) const {
  const bool mcmc = options_.strategy == Strategy::kMcmc;
  const int64_t most = mcmc ? options_.mcmc.cap_max : options_.densification.max_gaussians;
  const int64_t stop = mcmc ? options_.mcmc.refine_stop_iter : options_.densification.refine_stop_iter;
  return most > 0 && size() > most && step == std::min(stop, options_.steps - 1);
}

void Fitter::KeepToBudget(int64_t step, DensificationChange& change) {
  if (!CutsToBudget(step) || change.rows.any) return;
  const bool mcmc = options_.strategy == Strategy::kMcmc;
  const int64_t most = mcmc ? options_.mcmc.cap_max : options_.densification.max_gaussians;
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
  times.objective.render += gpu_times_.render;
  times.objective.backward += gpu_times_.backward;
  return times;
}

double Fitter::LastLoss() {
  LastPsnr();
  return last_loss_;
}

double Fitter::LastPsnr() {
  if (residence_.resident() != nullptr) {
    const auto loss = residence_.resident()->objective().Loss();
    if (!loss.ok()) return 0;
    last_loss_ = loss->loss.loss;
    last_psnr_ = -10 * std::log10(loss->mean_square);
  } else if (const auto psnr = Psnr(objective_.rendered(), picture_); psnr.ok()) {
    last_psnr_ = *psnr;
  }
  return last_psnr_;
}

GaussianCloud Fitter::UsableCloud() {
  GaussianCloud cloud = state().cloud;
  if (options_.mip_filter) FuseMipFilter(state_.mip_filter, cloud);
  std::vector<int64_t> usable;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (IsUsable(cloud, i)) usable.push_back(i);
  }
  if (static_cast<int64_t>(usable.size()) == cloud.size()) return cloud;
  return Subset(cloud, usable).value();
}

}  // namespace anchorsplat
