#include "enhance/pixel_size_features.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "core/framing.h"
#include "core/text.h"
#include "render/rasterizer.h"

namespace anchorsplat {

namespace {

constexpr float kVisibleOpacity = 0.1f;
constexpr int kViews = 6;         // all sides
constexpr int kRenderSize = 512;  // px; enough samples of the outline, and quick
constexpr double kFieldOfView = std::numbers::pi / 4;
constexpr float kTranslucentFrom = 0.7f, kTranslucentTo = 0.95f;
constexpr int kSearchOctaves = 3;  // either way from the middle axis
// Sky shells, floaters and giants say nothing about pixels and would drown what does: only Gaussians this close to the
// middle and this small count, in units of the radius that frames the cloud.
constexpr double kFarthest = 1.5;
constexpr double kLargestAxis = 0.25;

// Value at which `share` of the total weight is reached. `items` are (value, weight).
double WeightedQuantile(std::vector<std::pair<float, double>>& items, double share) {
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

// The part of the cloud that says something, without its colours.
GaussianCloud Telling(const GaussianCloud& cloud, const Framing& framing) {
  std::vector<int64_t> rows;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (!IsUsable(cloud, i)) continue;
    double distance = 0;
    for (size_t a = 0; a < 3; ++a) {
      const double d = cloud.means[static_cast<size_t>(3 * i) + a] - framing.target[a];
      distance += d * d;
    }
    const float* scales = cloud.log_scales.data() + 3 * i;
    const float longest = std::max({scales[0], scales[1], scales[2]});
    if (std::sqrt(distance) <= kFarthest * framing.radius && longest <= std::log(kLargestAxis * framing.radius)) {
      rows.push_back(i);
    }
  }
  GaussianCloud out;
  out.Resize(static_cast<int64_t>(rows.size()), 0);
  std::fill(out.sh.begin(), out.sh.end(), 0.0f);
  for (size_t k = 0; k < rows.size(); ++k) {
    const int64_t i = rows[k];
    std::copy_n(cloud.means.data() + 3 * i, 3, out.means.data() + 3 * k);
    std::copy_n(cloud.log_scales.data() + 3 * i, 3, out.log_scales.data() + 3 * k);
    std::copy_n(cloud.quats.data() + 4 * i, 4, out.quats.data() + 4 * k);
    out.opacity_logits[k] = cloud.opacity_logits[static_cast<size_t>(i)];
  }
  return out;
}

// Fills the axis features; false when there are too few Gaussians to say anything.
bool AxisFeatures(const GaussianCloud& cloud, PixelSizeFeatures& features) {
  std::vector<std::pair<float, double>> largest, middle;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    const float opacity = 1 / (1 + std::exp(-cloud.opacity_logits[static_cast<size_t>(i)]));
    if (opacity < kVisibleOpacity) continue;
    std::array<float, 3> axes;
    for (size_t a = 0; a < 3; ++a) axes[a] = std::exp(cloud.log_scales[static_cast<size_t>(3 * i) + a]);
    std::sort(axes.begin(), axes.end());
    const double weight = double{opacity} * axes[1] * axes[2];
    if (!(axes[0] > 0) || !(weight > 0)) continue;
    middle.emplace_back(axes[1], weight);
    largest.emplace_back(axes[2], weight);
  }
  if (static_cast<int64_t>(middle.size()) < kLeastGaussians) return false;
  features.middle_axis = WeightedQuantile(middle, 0.1);
  features.largest_axis = WeightedQuantile(largest, 0.1);
  return true;
}

// Renders one cloud from all sides with the dilation of different pixel sizes, each size once.
class TranslucentShare {
 public:
  static Result<TranslucentShare> Make(const GaussianCloud& cloud, const Framing& framing) {
    const Pinhole intrinsics = PinholeFromFov(kRenderSize, kRenderSize, kFieldOfView);
    const double distance = FramingDistance(framing, intrinsics);
    ANCHORSPLAT_ASSIGN_OR_RETURN(CameraSet cameras, OrbitCameras(kViews, distance, framing.target, intrinsics));
    return TranslucentShare(cloud, std::move(cameras), distance / intrinsics.fx);
  }

  Result<double> At(double pixel_size) {
    if (const auto known = known_.find(pixel_size); known != known_.end()) return known->second;
    const double in_pixels = pixel_size / render_pixel_;
    RenderOptions options;
    options.dilation = static_cast<float>(kDilation * in_pixels * in_pixels);
    options.sh_degree = 0;  // only alpha is looked at
    double covered = 0;
    int64_t translucent = 0;
    for (const Camera& camera : cameras_.cameras) {
      ANCHORSPLAT_RETURN_IF_ERROR(rasterizer_.Render(*cloud_, camera, options, output_));
      for (const float alpha : output_.alpha.pixels) {
        covered += alpha;
        translucent += alpha > kTranslucentFrom && alpha < kTranslucentTo ? 1 : 0;
      }
    }
    // One more pixel keeps the logarithms finite for pictures without any.
    const double share = static_cast<double>(translucent + 1) / (covered + 1);
    known_[pixel_size] = share;
    return share;
  }

 private:
  TranslucentShare(const GaussianCloud& cloud, CameraSet cameras, double render_pixel)
      : cloud_(&cloud), cameras_(std::move(cameras)), render_pixel_(render_pixel) {}

  const GaussianCloud* cloud_;
  CameraSet cameras_;
  double render_pixel_;  // world size of a rendered pixel at the target
  Rasterizer rasterizer_;
  RenderOutput output_;
  std::map<double, double> known_;
};

// Offset, in steps, of the vertex of the parabola through three equally spaced values with the least in the middle.
double Vertex(double left, double middle, double right) {
  const double bend = left - 2 * middle + right;
  return bend > 0 ? std::clamp(0.5 * (left - right) / bend, -0.5, 0.5) : 0;
}

}  // namespace

Result<PixelSizeFeatures> ComputePixelSizeFeatures(const GaussianCloud& whole) {
  const Framing framing = FrameCloud(whole);
  const GaussianCloud cloud = Telling(whole, framing);
  PixelSizeFeatures features;
  if (!AxisFeatures(cloud, features)) {
    return Error{ErrorCode::kBadArgument,
                 Cat("fewer than ", kLeastGaussians, " visible Gaussians to estimate a pixel size from")};
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(TranslucentShare share, TranslucentShare::Make(cloud, framing));

  // Whole octaves downhill from the middle axis, then half octaves around the least. Downhill rather than everywhere:
  // pixels as large as the cloud itself make it vanish, which is crisp as well.
  const auto size_at = [&](double octave) { return features.middle_axis * std::exp2(octave); };
  double best = 0;
  ANCHORSPLAT_ASSIGN_OR_RETURN(double least, share.At(size_at(best)));
  for (const double step : {-1.0, 1.0}) {
    for (double next = best + step; std::abs(next) <= kSearchOctaves; next += step) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const double value, share.At(size_at(next)));
      if (value >= least) break;
      least = value;
      best = next;
    }
  }
  if (std::abs(best) >= kSearchOctaves) {  // ran off: nothing opens and nothing closes within reason
    features.crispest = features.middle_axis;
    features.share = least;
    return features;
  }
  for (const double half : {best - 0.5, best + 0.5}) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const double value, share.At(size_at(half)));
    if (value < least) {
      least = value;
      best = half;
    }
  }
  std::array<double, 5> around;  // ln share at −1, −½, 0, ½, 1 octaves
  for (int k = 0; k < 5; ++k) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const double value, share.At(size_at(best + 0.5 * (k - 2))));
    around[static_cast<size_t>(k)] = std::log(value);
  }
  features.crispest = size_at(best + 0.5 * Vertex(around[1], around[2], around[3]));
  features.share = least;
  features.fall = around[0] - around[2];
  features.rise = around[4] - around[2];
  return features;
}

}  // namespace anchorsplat
