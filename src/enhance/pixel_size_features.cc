#include "enhance/pixel_size_features.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/activations.h"
#include "core/parallel.h"
#include "core/run_context.h"
#include "core/spherical_harmonics.h"
#include "core/statistics.h"
#include "core/text.h"
#include "enhance/cuts.h"
#include "enhance/showing_gaussians.h"

namespace anchorsplat {

namespace {

constexpr int kViews = 6;         // all sides
constexpr int kRenderSize = 512;  // px; enough samples of the outline, and quick
constexpr double kFieldOfView = std::numbers::pi / 4;
constexpr double kNearPlane = 0.01;  // of the distance; everything lies behind
constexpr double kSamples = 2;       // at least, per pixel of the size that is tried, along a side
constexpr double kOctavesPerStep = 0.5;
constexpr double kMostSteps = 12;  // either way from the start
// Brightness, that of the constant colour's brightest channel, up to which a Gaussian counts as unseen over black, and
// from which on as seen.
constexpr float kUnseen = 0.02f, kSeen = 0.1f;
// Times the median footprint. Fits of objects seen from all around have at most 0.02 of their outlines of such
// Gaussians; from five on, photographs have many.
constexpr float kCoarse = 6;
constexpr std::array<double, kSizeQuantiles> kQuantilesOfSizes = {0.1, 0.25, 0.5, 0.75};

// Value at which `share` of the total weight is reached. `items` are (value, weight).
double WeightedQuantile(std::vector<std::pair<float, double>>& items, double share) {
  LeaveIfAbandoned();
  std::sort(items.begin(), items.end());
  double total = 0;
  for (const auto& item : items) total += item.second;
  double sum = 0;
  for (const auto& item : items) {
    sum += item.second;
    if (sum >= share * total) return item.first;
  }
  return items.back().first;
}

// Instead of colours: how much of a Gaussian is seen over black.
void ShowBrightness(GaussianCloud& cloud) {
  for (size_t k = 0; k < cloud.sh.size(); k += 3) {
    float* const sh = cloud.sh.data() + k;
    const float brightness = 0.5f + kSh0 * std::max({sh[0], sh[1], sh[2]});
    const float seen = std::clamp((brightness - kUnseen) / (kSeen - kUnseen), 0.0f, 1.0f);
    std::fill_n(sh, 3, (seen - 0.5f) / kSh0);
  }
}

// ln √(largest × middle axis).
float LogFootprint(const GaussianCloud& cloud, int64_t i) {
  const float* const scales = cloud.log_scales.data() + 3 * i;
  std::array<float, 3> axes = {scales[0], scales[1], scales[2]};  // the smallest may be −∞
  std::ranges::sort(axes);
  return 0.5f * (axes[1] + axes[2]);
}

// LogFootprint from which on a Gaussian is coarse among the others.
float LogCoarse(const GaussianCloud& cloud) {
  Buffer<float> showing;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (Sigmoid(cloud.opacity_logits[static_cast<size_t>(i)]) < kShowingOpacity) continue;
    if (const float footprint = LogFootprint(cloud, i); std::isfinite(footprint)) showing.push_back(footprint);
  }
  return showing.empty() ? std::numeric_limits<float>::infinity() : Quantile(showing, 0.5) + std::log(kCoarse);
}

// Instead of green: whether it was cut; instead of blue: whether it is coarse.
bool MarkLeftOut(GaussianCloud& cloud, std::span<const Cut> cuts) {
  const float coarse = LogCoarse(cloud);
  std::atomic<bool> any = false;
  ParallelFor(0, cloud.size(), 4096, [&](int64_t first, int64_t last) {
    bool found = false;
    for (int64_t i = first; i < last; ++i) {
      const bool is_cut = std::ranges::any_of(cuts, [&](const Cut& c) { return c.Depth(cloud, i) < kCutReach; });
      const bool is_coarse = !is_cut && LogFootprint(cloud, i) > coarse;
      cloud.sh[static_cast<size_t>(3 * i + 1)] = ((is_cut ? 1.0f : 0.0f) - 0.5f) / kSh0;
      cloud.sh[static_cast<size_t>(3 * i + 2)] = ((is_coarse ? 1.0f : 0.0f) - 0.5f) / kSh0;
      found = found || is_cut || is_coarse;
    }
    if (found) any = true;
  });
  return any;
}

// √(largest × middle axis) of their 10 % quantiles over the visible Gaussians, weighted by opacity × area (product of
// the two): within a factor of three of the pixel size for most fits. Nothing when there are too few Gaussians.
std::optional<double> AxisOfSmallGaussians(const GaussianCloud& cloud) {
  LeaveIfAbandoned();
  std::vector<std::pair<float, double>> largest, middle;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    const float opacity = Sigmoid(cloud.opacity_logits[static_cast<size_t>(i)]);
    if (opacity < kShowingOpacity) continue;
    std::array<float, 3> axes;
    for (size_t a = 0; a < 3; ++a) axes[a] = std::exp(cloud.log_scales[static_cast<size_t>(3 * i) + a]);
    std::sort(axes.begin(), axes.end());
    const double weight = double{opacity} * axes[1] * axes[2];
    if (!(weight > 0)) continue;
    middle.emplace_back(axes[1], weight);
    largest.emplace_back(axes[2], weight);
  }
  if (static_cast<int64_t>(middle.size()) < kLeastGaussians) return std::nullopt;
  return std::sqrt(double{WeightedQuantile(middle, 0.1)} * double{WeightedQuantile(largest, 0.1)});
}

// SizeFeatures with d = 1.
SizeFeatures SizesOf(const GaussianCloud& cloud) {
  LeaveIfAbandoned();
  std::array<std::vector<std::pair<float, double>>, 4> values;  // the three axes, ascending, and opacity
  for (int64_t i = 0; i < cloud.size(); ++i) {
    const float opacity = Sigmoid(cloud.opacity_logits[static_cast<size_t>(i)]);
    if (opacity < kShowingOpacity) continue;
    std::array<float, 3> axes;
    for (size_t a = 0; a < 3; ++a) axes[a] = std::exp(cloud.log_scales[static_cast<size_t>(3 * i) + a]);
    std::sort(axes.begin(), axes.end());
    const double weight = double{opacity} * axes[1] * axes[2];
    if (!(weight > 0)) continue;
    for (size_t a = 0; a < 3; ++a) values[a].emplace_back(axes[a], weight);
    values[3].emplace_back(opacity, weight);
  }
  SizeFeatures features{};
  size_t next = 0;
  for (size_t kind = 0; kind < values.size(); ++kind) {
    for (const double quantile : kQuantilesOfSizes) {
      const double value = values[kind].empty() ? 1 : WeightedQuantile(values[kind], quantile);
      features[next++] = kind == 3 ? value : std::log(std::max(value, 1e-30));
    }
  }
  features[next] = std::log(static_cast<double>(std::max<size_t>(1, values[0].size())));
  return features;
}

double ShareShowing(const GaussianCloud& cloud) {
  const auto shows = [](float logit) { return Sigmoid(logit) >= kShowingOpacity; };
  return static_cast<double>(std::ranges::count_if(cloud.opacity_logits, shows)) / static_cast<double>(cloud.size());
}

}  // namespace

Result<PixelSizeProbe> PixelSizeProbe::Make(const GaussianCloud& whole) { return Make(FindTellingGaussians(whole)); }

Result<PixelSizeProbe> PixelSizeProbe::Make(TellingGaussians telling) {
  const Framing& framing = telling.framing;
  const double radius = telling.radius();
  PixelSizeProbe probe;
  probe.cloud_ = std::move(telling.cloud);
  std::vector<Cut> cuts = FindCuts(probe.cloud_);
  if (telling.reach) cuts.push_back({.ball = true, .direction = framing.target, .reach = *telling.reach});
  ShowBrightness(probe.cloud_);
  probe.left_out_ = MarkLeftOut(probe.cloud_, cuts);
  const std::optional<double> start = AxisOfSmallGaussians(probe.cloud_);
  if (!start) {
    return Error{ErrorCode::kBadArgument,
                 Cat("fewer than ", kLeastGaussians,
                     " Gaussians that show and are small beside the splat, to estimate a pixel size from")};
  }
  probe.start_ = *start;
  probe.showing_ = ShareShowing(probe.cloud_);
  probe.sizes_ = SizesOf(probe.cloud_);
  const Pinhole intrinsics = PinholeFromFov(kRenderSize, kRenderSize, kFieldOfView);
  probe.distance_ = FramingDistance({framing.target, radius}, intrinsics);
  probe.farthest_pixel_ = probe.distance_ / intrinsics.fx;
  ANCHORSPLAT_ASSIGN_OR_RETURN(probe.cameras_, OrbitCameras(kViews, probe.distance_, framing.target, intrinsics));
  return probe;
}

Result<PixelSizeProbe::OutlineValues> PixelSizeProbe::AtStep(int step, Look look) {
  if (const auto known = known_.find({look, step}); known != known_.end()) return known->second.values;
  const double size = start_ * std::exp2(step * kOctavesPerStep);
  const double pixel = std::min(farthest_pixel_, size / kSamples);
  RenderOptions options;
  const double in_pixels = size / pixel;
  options.dilation = static_cast<float>(kDilation * in_pixels * in_pixels);
  options.mode = look == Look::kAntialiased ? RenderMode::kAntialiased : RenderMode::kClassic;
  options.near_plane = static_cast<float>(kNearPlane * distance_);  // scales with the cloud, as all does
  options.far_plane = static_cast<float>(distance_ / kNearPlane);
  OutlineProfile profile;
  for (Camera& camera : cameras_.cameras) {
    camera.intrinsics.fx = camera.intrinsics.fy = distance_ / pixel;
    ANCHORSPLAT_RETURN_IF_ERROR(rasterizer_.Render(cloud_, camera, options, output_));
    // Of colours, the first channel is looked at; the others are how much of a pixel cut and coarse Gaussians make.
    const size_t channel = output_.alpha.pixels.size();
    const float* cut = left_out_ ? output_.color.pixels.data() + channel : nullptr;
    profile.Add(look == Look::kOverBlack ? output_.color : output_.alpha, pixel / size, cut,
                left_out_ ? cut + channel : nullptr);
  }
  return (known_[{look, step}] = {profile.Values(), profile.Cut(), profile.Coarse()}).values;
}

double PixelSizeProbe::StepOf(double size) const {
  return std::clamp(std::log2(size / start_) / kOctavesPerStep, -kMostSteps, kMostSteps);
}

PixelSizeProbe::Seen PixelSizeProbe::NearestTo(double size, Look look) const {
  const double at = StepOf(size);
  double nearest = std::numeric_limits<double>::infinity();
  Seen nearest_seen;
  for (const auto& [key, seen] : known_) {
    if (key.first != look || std::abs(key.second - at) >= nearest) continue;
    nearest = std::abs(key.second - at);
    nearest_seen = seen;
  }
  return nearest_seen;
}

Result<PixelSizeProbe::OutlineValues> PixelSizeProbe::ProfileAt(double size, Look look) {
  const double at = StepOf(size);
  const double below = std::floor(at), part = at - below;
  ANCHORSPLAT_ASSIGN_OR_RETURN(OutlineValues values, AtStep(static_cast<int>(below), look));
  if (part == 0) return values;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const OutlineValues above, AtStep(static_cast<int>(below) + 1, look));
  for (size_t k = 0; k < kOutlineValues; ++k) values[k] += part * (above[k] - values[k]);
  return values;
}

Result<PixelSizeFeatures> PixelSizeProbe::At(double size, Look look) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const OutlineValues smaller, ProfileAt(size / std::numbers::sqrt2, look));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const OutlineValues middle, ProfileAt(size, look));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const OutlineValues larger, ProfileAt(size * std::numbers::sqrt2, look));
  PixelSizeFeatures features{};
  for (size_t k = 0; k < kOutlineValues; ++k) {
    features[k] = middle[k];
    features[kOutlineValues + k] = larger[k] - smaller[k];
    features[2 * kOutlineValues + k] = larger[k] + smaller[k] - 2 * middle[k];
  }
  return features;
}

SizeFeatures PixelSizeProbe::SizesAt(double size) const {
  SizeFeatures features = sizes_;
  for (size_t k = 0; k < 3 * kSizeQuantiles; ++k) features[k] -= std::log(size);
  return features;
}

}  // namespace anchorsplat
