#include "enhance/refiner.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "core/stopwatch.h"
#include "core/text.h"
#include "fit/random_streams.h"
#include "fit/view_exposure.h"
#include "metrics/image_metrics.h"

namespace anchorsplat {

namespace {

// Smallest error that counts as an outlier, so that missing detail does not; and when outliers are first rejected: at
// the beginning everything may be wrong.
constexpr double kLeastOutlier = 0.1, kTrustFrom = 0.3;
constexpr int kFirstSteps = 3;  // alignment steps when a view is first visited
constexpr int kTries = 16;      // attempts to find a Gaussian in the view

LearningRates Scaled(LearningRates rates, double factor) {
  for (double* rate : {&rates.means, &rates.scales, &rates.opacities, &rates.quats, &rates.sh0, &rates.sh_rest}) {
    *rate *= factor;
  }
  return rates;
}

// Resets the last rows of `cloud` to `fixed`.
void PutBack(const GaussianCloud& fixed, GaussianCloud& cloud) {
  const auto copy = [](const Buffer<float>& from, Buffer<float>& to) {
    std::copy(from.begin(), from.end(), to.end() - std::ssize(from));
  };
  copy(fixed.means, cloud.means);
  copy(fixed.log_scales, cloud.log_scales);
  copy(fixed.quats, cloud.quats);
  copy(fixed.opacity_logits, cloud.opacity_logits);
  copy(fixed.sh, cloud.sh);
}

}  // namespace

std::vector<int64_t> RowsForWindow(const Camera& camera, int64_t gaussians, uint64_t seed, int64_t step) {
  std::vector<int64_t> rows;
  const Pinhole& k = camera.intrinsics;
  if (gaussians == 0 || (k.width <= kWindow && k.height <= kWindow)) return rows;
  Random random = RandomStream(seed, RandomPurpose::kCrop, step);
  for (int i = 0; i < kTries; ++i) rows.push_back(random.Below(gaussians));
  return rows;
}

PixelBox WindowAround(const Camera& camera, std::span<const float> means) {
  const Pinhole& k = camera.intrinsics;
  const int width = std::min(k.width, kWindow), height = std::min(k.height, kWindow);
  if (width == k.width && height == k.height) return {0, 0, width, height};
  double x = 0.5 * k.width, y = 0.5 * k.height;
  for (size_t i = 0; i + 2 < means.size(); i += 3) {
    const auto c = camera.ToCamera({means[i], means[i + 1], means[i + 2]});
    if (!(c[2] > 0)) continue;
    const double u = k.fx * c[0] / c[2] + k.cx, v = k.fy * c[1] / c[2] + k.cy;
    if (!(u >= 0 && u < k.width && v >= 0 && v < k.height)) continue;
    x = u, y = v;
    break;
  }
  const int x0 = std::clamp(static_cast<int>(x) - width / 2, 0, k.width - width);
  const int y0 = std::clamp(static_cast<int>(y) - height / 2, 0, k.height - height);
  return {x0, y0, x0 + width, y0 + height};
}

PixelBox ChooseWindow(const Camera& camera, const GaussianCloud& cloud, uint64_t seed, int64_t step) {
  std::vector<float> means;
  for (const int64_t row : RowsForWindow(camera, cloud.size(), seed, step)) {
    means.insert(means.end(), cloud.means.data() + 3 * row, cloud.means.data() + 3 * row + 3);
  }
  return WindowAround(camera, means);
}

Result<Refiner> Refiner::Begin(const RefineOptions& options, const RefineProblem& problem, RefineTargets targets,
                               FitState state) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(options));
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(PixelModel{1, problem.upscale}));
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(state.cloud));
  if (targets.views().empty()) return Error{ErrorCode::kBadArgument, "refine: there are no views to compare with"};
  if (state.cloud.empty()) return Error{ErrorCode::kBadArgument, "refine: there are no Gaussians"};
  Refiner refiner(options, problem, std::move(targets), std::move(state));
  if (!options.align) refiner.residence_.MoveToGpu(refiner.state_);
  return refiner;
}

Refiner::Refiner(const RefineOptions& options, const RefineProblem& problem, RefineTargets targets, FitState state)
    : options_(options),
      problem_(problem),
      targets_(std::move(targets)),
      state_(std::move(state)),
      order_(static_cast<int64_t>(targets_.views().size()), problem.seed) {}

int64_t Refiner::size() const {
  return residence_.resident() != nullptr ? residence_.resident()->size() : state_.cloud.size();
}

FitState& Refiner::state() {
  if (residence_.resident() != nullptr) {
    if (const Status copied = residence_.CopyToHost(state_); !copied.ok())
      residence_.MoveToHost(state_, copied.error());
  }
  return state_;
}

bool Refiner::MoveToHost() {
  if (residence_.resident() == nullptr) return true;
  const Status home = residence_.MoveToHost(state_);
  return home.ok() || residence_.MoveToHost(state_, home.error());
}

// Copies the render into the target where it is ignored.
void Refiner::AdjustTarget(const Image& rendered, double done) {
  Image& picture = target_.picture;
  FillIgnored(target_.ignored, rendered, picture);  // so that they have no effect below
  if (options_.exposure) {
    const auto exposure = EstimateExposure(rendered, picture);
    if (exposure.ok()) RemoveExposure(*exposure, picture);
  }
  if (options_.robust) {
    const double least = std::max(kLeastOutlier, 1 - done / kTrustFrom);
    (void)IgnoreOutliers(rendered, static_cast<float>(least), picture);
  }
  FillIgnored(target_.ignored, rendered, picture);
}

// The view's camera after one more alignment step.
Result<Camera> Refiner::AlignedView(int64_t view, const PixelBox& window) {
  Buffer<float>& motions = state_.motions;
  const Camera& origin = targets_.views()[static_cast<size_t>(view)];
  if (motions.size() != 6 * targets_.views().size()) motions.assign(6 * targets_.views().size(), 0.0f);
  float* motion = motions.data() + 6 * view;
  const auto placed = [&] {
    std::array<double, 6> at;
    std::copy_n(motion, 6, at.begin());
    return Moved(origin, at);
  };
  if (!target_.ignored.empty()) {  // masked pixels must not affect the pose
    ANCHORSPLAT_RETURN_IF_ERROR(objective_.Show({.render = problem_.render, .loss = {}, .pixel = {1, problem_.upscale}},
                                                state_.cloud, Crop(placed(), window)));
    FillIgnored(target_.ignored, objective_.rendered(), target_.picture);
  }
  const bool first_time = state_.step < static_cast<int64_t>(targets_.views().size());
  // One ray per pixel is accurate enough for alignment.
  ANCHORSPLAT_ASSIGN_OR_RETURN(
      const Camera found,
      aligner_.Align(state_.cloud, RaysOf(PixelModel{1, problem_.upscale}, problem_.render), Crop(origin, window),
                     Crop(placed(), window), target_.picture, options_.exposure, first_time ? kFirstSteps : 1));
  const std::array<double, 6> moved = MotionBetween(origin, found);
  std::transform(moved.begin(), moved.end(), motion, [](double x) { return static_cast<float>(x); });
  return placed();
}

Result<PixelBox> Refiner::WindowOnGpu(const Camera& view) {
  const std::vector<int64_t> rows = RowsForWindow(view, size(), problem_.seed, state_.step);
  if (rows.empty()) return WindowAround(view, {});
  ANCHORSPLAT_ASSIGN_OR_RETURN(const GaussianCloud there, residence_.resident()->ReadRows(rows));
  return WindowAround(view, there.means);
}

Result<FitStep> Refiner::Step(double done) {
  Stopwatch watch;
  const int64_t step = state_.step;
  FitStep out;
  out.view = order_.At(step);
  const Camera& view = targets_.views()[static_cast<size_t>(out.view)];
  ObjectiveOptions objective;
  objective.render = problem_.render;
  objective.loss.ssim_weight = options_.ssim_weight;
  objective.pixel = PixelModelAt({problem_.upscale, options_.half_from, options_.all_from}, done);
  const LearningRates rates = Scaled(LearningRates(), options_.rate.value_or(1) * std::pow(options_.rate_decay, done));
  targets_.LoadAhead(order_.From(step));
  if (residence_.resident() != nullptr) {
    const Result<PixelBox> window = WindowOnGpu(view);
    const Status learned = window.ok() ? LearnOnGpu(objective, rates, out.view, *window, done) : Status(window.error());
    if (!learned.ok()) {
      if (!residence_.MoveToHost(state_, learned.error())) return out;  // `done` belongs to a later step
      return Step(done);
    }
  } else {
    const PixelBox window = ChooseWindow(view, state_.cloud, problem_.seed, step);
    ANCHORSPLAT_RETURN_IF_ERROR(targets_.Load(out.view, window, target_));
    times_.load += watch.Lap();
    Camera camera = Crop(view, window);
    if (options_.align) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const Camera aligned, AlignedView(out.view, window));
      camera = Crop(aligned, window);
    }
    ANCHORSPLAT_RETURN_IF_ERROR(Learn(objective, rates, camera, done));
  }
  ++state_.step;
  if (residence_.resident() != nullptr && Residence::IsCopyDue(state_.step)) state();
  return out;
}

Status Refiner::Learn(const ObjectiveOptions& objective, const LearningRates& rates, const Camera& camera,
                      double done) {
  ANCHORSPLAT_RETURN_IF_ERROR(objective_.Show(objective, state_.cloud, camera));
  AdjustTarget(objective_.rendered(), done);
  const CoefficientStep coefficients = state_.optimizer.BeginStep(rates, kMaxShDegree, state_.cloud);
  ANCHORSPLAT_RETURN_IF_ERROR(objective_.Compare(objective, state_.cloud, target_.picture, gradient_, &coefficients));
  Stopwatch watch;
  state_.optimizer.FinishStep(rates, rates.means * problem_.scene_scale, gradient_, state_.cloud);
  PutBack(problem_.fixed, state_.cloud);
  times_.adam += watch.Lap();
  return {};
}

Status Refiner::LearnOnGpu(const ObjectiveOptions& objective, const LearningRates& rates, int64_t view,
                           const PixelBox& window, double done) {
  Stopwatch watch;
  ResidentFit& fit = *residence_.resident();
  GpuObjective& shown = fit.objective();
  const Camera& camera = targets_.views()[static_cast<size_t>(view)];
  const bool whole = window == PixelBox{0, 0, camera.intrinsics.width, camera.intrinsics.height};
  const bool adjusts = options_.exposure || options_.robust;
  if (PictureCache* pictures = targets_.pictures(); pictures != nullptr && whole && !adjusts) {
    if (!shown.Holds(view)) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const PackedPicture packed, pictures->LoadPacked(view));
      ANCHORSPLAT_RETURN_IF_ERROR(shown.SetTarget(packed, pictures->background(), view));
    }
  } else if (adjusts || !whole || !shown.Holds(view)) {
    ANCHORSPLAT_RETURN_IF_ERROR(targets_.Load(view, window, target_));
    if (!adjusts) {
      ANCHORSPLAT_RETURN_IF_ERROR(
          shown.SetTarget(target_.picture, target_.ignored, whole ? std::optional(view) : std::nullopt));
    }
  }
  times_.load += watch.Lap();
  ANCHORSPLAT_ASSIGN_OR_RETURN(const bool drawn, fit.Show(objective, Crop(camera, window)));
  if (!drawn) return Error{ErrorCode::kBadArgument, Cat("a GPU's floats are too few digits for ", camera.name)};
  if (adjusts) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Image* rendered, shown.Rendered());
    AdjustTarget(*rendered, done);
    ANCHORSPLAT_RETURN_IF_ERROR(shown.SetTarget(target_.picture, target_.ignored));
  }
  times_.objective.render += watch.Lap();
  ANCHORSPLAT_RETURN_IF_ERROR(fit.Learn(objective, whole && !adjusts ? view : -1,
                                        {.rates = rates,
                                         .means_rate = rates.means * problem_.scene_scale,
                                         .sh_degree = kMaxShDegree,
                                         .number = state_.step + 1,
                                         .learning = fit.size() - problem_.fixed.size()}));
  residence_.CountStep();
  times_.objective.backward += watch.Lap();
  return {};
}

FitTimes Refiner::times() const {
  FitTimes times = times_;
  const ObjectiveTimes& here = objective_.times();
  times.objective.render += here.render;
  times.objective.loss += here.loss;
  times.objective.backward += here.backward;
  return times;
}

double Refiner::LastPsnr() {
  if (residence_.resident() != nullptr) {
    const auto loss = residence_.resident()->objective().Loss();
    return loss.ok() ? -10 * std::log10(loss->mean_square) : 0;
  }
  const auto psnr = Psnr(objective_.rendered(), target_.picture);
  return psnr.ok() ? *psnr : 0;
}

}  // namespace anchorsplat
