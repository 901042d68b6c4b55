#include "enhance/refiner.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/stopwatch.h"
#include "fit/random_streams.h"
#include "fit/view_exposure.h"
#include "metrics/image_metrics.h"

namespace anchorsplat {

namespace {

// Of full scale, what detail that is still missing may differ by; in the beginning, when everything may be wrong,
// nothing is an outlier.
constexpr double kLeastOutlier = 0.1, kTrustFrom = 0.3;
constexpr int kFirstSteps = 3;  // of alignment, when a view is seen for the first time
constexpr int kTries = 16;      // for a Gaussian that the camera sees

LearningRates Scaled(LearningRates rates, double factor) {
  for (double* rate : {&rates.means, &rates.scales, &rates.opacities, &rates.quats, &rates.sh0, &rates.sh_rest}) {
    *rate *= factor;
  }
  return rates;
}

}  // namespace

PixelBox ChooseWindow(const Camera& camera, const GaussianCloud& cloud, uint64_t seed, int64_t step) {
  const Pinhole& k = camera.intrinsics;
  const int width = std::min(k.width, kWindow), height = std::min(k.height, kWindow);
  if (width == k.width && height == k.height) return {0, 0, width, height};
  Random random = RandomStream(seed, RandomPurpose::kCrop, step);
  double x = 0.5 * k.width, y = 0.5 * k.height;
  for (int i = 0; i < kTries && !cloud.empty(); ++i) {
    const float* p = cloud.means.data() + 3 * random.Below(cloud.size());
    const auto c = camera.ToCamera({p[0], p[1], p[2]});
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

Result<Refiner> Refiner::Begin(const RefineOptions& options, const RefineProblem& problem, RefineTargets targets,
                               FitState state) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(options));
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(PixelModel{1, problem.upscale}));
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(state.cloud));
  if (targets.views().empty()) return Error{ErrorCode::kBadArgument, "refine: there are no views to compare with"};
  if (state.cloud.empty()) return Error{ErrorCode::kBadArgument, "refine: there are no Gaussians"};
  return Refiner(options, problem, std::move(targets), std::move(state));
}

Refiner::Refiner(const RefineOptions& options, const RefineProblem& problem, RefineTargets targets, FitState state)
    : options_(options),
      problem_(problem),
      targets_(std::move(targets)),
      state_(std::move(state)),
      order_(static_cast<int64_t>(targets_.views().size()), problem.seed) {}

// Where nothing is to be learned the target becomes what is there.
void Refiner::AdjustTarget(double done) {
  const Image& rendered = objective_.rendered();
  Image& picture = target_.picture;
  FillIgnored(target_.ignored, rendered, picture);  // which are not to weigh in what follows
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

// Where the view's picture was taken, as far as the candidate says now: a step nearer than the last time.
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
  if (!target_.ignored.empty()) {  // what a mask leaves out pulls at no pose
    ANCHORSPLAT_RETURN_IF_ERROR(objective_.Show({.render = problem_.render, .loss = {}, .pixel = {1, problem_.upscale}},
                                                state_.cloud, Crop(placed(), window)));
    FillIgnored(target_.ignored, objective_.rendered(), target_.picture);
  }
  const bool first_time = state_.step < static_cast<int64_t>(targets_.views().size());
  // One ray per pixel tells well enough where things are.
  ANCHORSPLAT_ASSIGN_OR_RETURN(
      const Camera found,
      aligner_.Align(state_.cloud, RaysOf(PixelModel{1, problem_.upscale}, problem_.render), Crop(origin, window),
                     Crop(placed(), window), target_.picture, options_.exposure, first_time ? kFirstSteps : 1));
  const std::array<double, 6> moved = MotionBetween(origin, found);
  std::transform(moved.begin(), moved.end(), motion, [](double x) { return static_cast<float>(x); });
  return placed();
}

Result<FitStep> Refiner::Step(double done) {
  Stopwatch watch;
  const int64_t step = state_.step;
  FitStep out;
  out.view = order_.At(step);
  const Camera& view = targets_.views()[static_cast<size_t>(out.view)];
  const PixelBox window = ChooseWindow(view, state_.cloud, problem_.seed, step);
  targets_.LoadAhead(order_.From(step));
  ANCHORSPLAT_RETURN_IF_ERROR(targets_.Load(out.view, window, target_));
  times_.load += watch.Lap();

  ObjectiveOptions objective;
  objective.render = problem_.render;
  objective.loss.ssim_weight = options_.ssim_weight;
  objective.pixel = PixelModelAt({problem_.upscale, options_.half_from, options_.all_from}, done);
  Camera camera = Crop(view, window);
  if (options_.align) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Camera aligned, AlignedView(out.view, window));
    camera = Crop(aligned, window);
  }
  ANCHORSPLAT_RETURN_IF_ERROR(objective_.Show(objective, state_.cloud, camera));
  AdjustTarget(done);
  const LearningRates rates = Scaled(LearningRates(), options_.rate.value_or(1) * std::pow(options_.rate_decay, done));
  const CoefficientStep coefficients = state_.optimizer.BeginStep(rates, kMaxShDegree, state_.cloud);
  ANCHORSPLAT_ASSIGN_OR_RETURN(out.loss,
                               objective_.Compare(objective, state_.cloud, target_.picture, gradient_, &coefficients));

  watch.Lap();
  state_.optimizer.FinishStep(rates, rates.means * problem_.scene_scale, gradient_, state_.cloud);
  times_.adam += watch.Lap();
  ++state_.step;
  return out;
}

FitTimes Refiner::times() const {
  FitTimes times = times_;
  times.objective = objective_.times();
  return times;
}

double Refiner::LastPsnr() const {
  const auto psnr = Psnr(objective_.rendered(), target_.picture);
  return psnr.ok() ? *psnr : 0;
}

}  // namespace anchorsplat
