#include "reading/splat_pictures.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "core/activations.h"
#include "core/camera.h"
#include "core/framing.h"
#include "core/parallel.h"
#include "core/run_context.h"
#include "core/spherical_harmonics.h"
#include "core/statistics.h"
#include "render/constant_cloud.h"
#include "render/rasterizer.h"

namespace anchorsplat {

namespace {

constexpr int kViews = 4;
constexpr int kSide = 256;             // px: enough outline, and fast
constexpr double kDetailPixel = 0.25;  // of the unit
constexpr double kFieldOfView = std::numbers::pi / 4;
constexpr double kNearPlane = 0.01;  // relative to the distance; everything is behind it
constexpr double kSamples = 2;       // rendered pixels per pixel size tried
// Gaussians with this many times the median footprint are coarse: a ground, walls or clutter that no picture shows
// well. In fits of objects seen from all around they form at most 0.02 of the outlines; in photographs, at five and
// above, many.
constexpr float kCoarse = 6;

// ln √(largest × middle axis).
float LogFootprint(const GaussianCloud& cloud, int64_t i) {
  const float* const scales = cloud.log_scales.data() + 3 * i;
  std::array<float, 3> axes = {scales[0], scales[1], scales[2]};  // the smallest may be −∞
  std::ranges::sort(axes);
  return 0.5f * (axes[1] + axes[2]);
}

// LogFootprint from which a Gaussian is coarse.
float LogCoarse(const GaussianCloud& cloud) {
  Buffer<float> visible;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (Sigmoid(cloud.opacity_logits[static_cast<size_t>(i)]) < kVisibleOpacity) continue;
    if (const float footprint = LogFootprint(cloud, i); std::isfinite(footprint)) visible.push_back(footprint);
  }
  return visible.empty() ? std::numeric_limits<float>::infinity() : Quantile(visible, 0.5) + std::log(kCoarse);
}

// Whether Gaussian i extends beyond the region looked at.
bool IsCut(const CentralGaussians& central, int64_t i) {
  if (!central.reach) return false;
  double squares = 0;
  for (size_t a = 0; a < 3; ++a) {
    const double d = central.cloud.means[static_cast<size_t>(3 * i) + a] - central.framing.target[a];
    squares += d * d;
  }
  const float* const scales = central.cloud.log_scales.data() + 3 * i;
  return std::sqrt(squares) + 3 * std::exp(double{std::max({scales[0], scales[1], scales[2]})}) > *central.reach;
}

class Painter {
 public:
  explicit Painter(const CentralGaussians& central) : cloud_(central.cloud), colors_(central.cloud.sh) {
    const Pinhole intrinsics = PinholeFromFov(kSide, kSide, kFieldOfView);
    distance_ = FramingDistance({central.framing.target, central.radius()}, intrinsics);
    farthest_pixel_ = distance_ / intrinsics.fx;
    marked_ = Mark(central);
    still_.emplace(cloud_);
    options_.near_plane = static_cast<float>(kNearPlane * distance_);  // scales with the cloud, like everything
    options_.far_plane = static_cast<float>(distance_ / kNearPlane);
  }

  Status Prepare(const CentralGaussians& central) {
    const Pinhole intrinsics = PinholeFromFov(kSide, kSide, kFieldOfView);
    ANCHORSPLAT_ASSIGN_OR_RETURN(cameras_, OrbitCameras(kViews, distance_, central.framing.target, intrinsics));
    return {};
  }

  Status Outlines(double size, RenderMode mode, std::array<double, kOutlineValues>& values, double* cut,
                  double* coarse) {
    const double pixel = std::min(farthest_pixel_, size / kSamples);
    const double in_pixels = size / pixel;
    options_.dilation = static_cast<float>(kDilation * in_pixels * in_pixels);
    options_.mode = mode;
    OutlineProfile profile;
    ANCHORSPLAT_RETURN_IF_ERROR(Draw(pixel, [&](const RenderOutput& output) {
      const size_t channel = output.alpha.pixels.size();
      const float* const of_cut = marked_ ? output.color.pixels.data() + channel : nullptr;
      profile.Add(output.alpha, pixel / size, of_cut, marked_ ? of_cut + channel : nullptr);
    }));
    values = profile.Values();
    if (cut != nullptr) *cut = profile.Cut();
    if (coarse != nullptr) *coarse = profile.Coarse();
    return {};
  }

  // Mean squares of details per level, then of all details.
  Status Details(double unit, std::array<double, SplatPictures::kDetails + 1>& of_luminance,
                 std::array<double, SplatPictures::kDetails + 1>& of_alpha) {
    still_.reset();
    cloud_.sh = colors_;
    still_.emplace(cloud_);
    options_.dilation = std::nullopt;
    options_.mode = RenderMode::kClassic;
    const double pixel = std::min(farthest_pixel_, kDetailPixel * unit);
    return Draw(pixel, [&](const RenderOutput& output) {
      Buffer<float> luminance(output.alpha.pixels.size());
      const float* const color = output.color.pixels.data();
      for (size_t i = 0; i < luminance.size(); ++i) {
        luminance[i] = (color[i] + color[i + luminance.size()] + color[i + 2 * luminance.size()]) / 3;
      }
      AddDetails(std::move(luminance), of_luminance);
      AddDetails(output.alpha.pixels, of_alpha);
    });
  }

 private:
  // Renders from all cameras.
  Status Draw(double pixel, const std::function<void(const RenderOutput&)>& look) {
    std::vector<Camera> cameras = cameras_.cameras;
    for (Camera& camera : cameras) {
      camera.intrinsics = {.width = kSide,
                           .height = kSide,
                           .fx = distance_ / pixel,
                           .fy = distance_ / pixel,
                           .cx = kSide / 2.0,
                           .cy = kSide / 2.0};
    }
    LeaveIfAbandoned();
    return rasterizer_.RenderEach(*still_, cameras, options_, [&](size_t, RenderOutput& output) -> Status {
      look(output);
      LeaveIfAbandoned();
      return {};
    });
  }

  // Recolours: green marks cut Gaussians, blue coarse ones.
  bool Mark(const CentralGaussians& central) {
    const float coarse = LogCoarse(cloud_);
    std::atomic<bool> any = false;
    ParallelFor(0, cloud_.size(), 4096, [&](int64_t first, int64_t last) {
      bool found = false;
      for (int64_t i = first; i < last; ++i) {
        const bool is_cut = IsCut(central, i);
        const bool is_coarse = !is_cut && LogFootprint(cloud_, i) > coarse;
        float* const sh = cloud_.sh.data() + 3 * i;
        sh[0] = 0;
        sh[1] = ((is_cut ? 1.0f : 0.0f) - 0.5f) / kSh0;
        sh[2] = ((is_coarse ? 1.0f : 0.0f) - 0.5f) / kSh0;
        found = found || is_cut || is_coarse;
      }
      if (found) any = true;
    });
    return any;
  }

  // Adds a picture's (kSide²) squared Haar details per level.
  static void AddDetails(Buffer<float> values, std::array<double, SplatPictures::kDetails + 1>& sums) {
    int side = kSide;
    const double share = 1.0 / (static_cast<double>(kSide) * kSide * kViews);
    for (const float value : values) sums.back() += share * double{value} * double{value};
    for (size_t level = 0; level < SplatPictures::kDetails; ++level) {
      const int half = side / 2;
      const auto width = static_cast<size_t>(side);
      double squares = 0;
      for (size_t y = 0; y < static_cast<size_t>(half); ++y) {
        for (size_t x = 0; x < static_cast<size_t>(half); ++x) {
          const float* const at = values.data() + 2 * y * width + 2 * x;
          const double a{at[0]}, b{at[1]}, c{at[width]}, d{at[width + 1]};
          const double mean = (a + b + c + d) / 4;
          squares += (a * a + b * b + c * c + d * d) / 4 - mean * mean;
          values[y * static_cast<size_t>(half) + x] = static_cast<float>(mean);
        }
      }
      sums[level] += std::max(0.0, squares) / (static_cast<double>(half) * half * kViews);
      side = half;
    }
  }

  GaussianCloud cloud_;
  std::optional<ConstantCloud> still_;  // of `cloud_` as it is now
  Buffer<float> colors_;
  CameraSet cameras_;
  double distance_ = 0;
  double farthest_pixel_ = 0;  // world size of a pixel when the whole cloud is in the picture
  bool marked_ = false;
  RenderOptions options_;
  Rasterizer rasterizer_;
};

}  // namespace

SplatPictures UnknownPictures() {
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  SplatPictures pictures;
  for (SplatPictures::AtSize& at : pictures.sizes) {
    at.classic.fill(kUnknown), at.antialiased.fill(kUnknown);
    at.cut = at.coarse = kUnknown;
  }
  pictures.of_luminance.fill(kUnknown), pictures.of_alpha.fill(kUnknown);
  return pictures;
}

Result<SplatPictures> MeasurePictures(const CentralGaussians& central, double unit) {
  Painter painter(central);
  ANCHORSPLAT_RETURN_IF_ERROR(painter.Prepare(central));
  SplatPictures pictures;
  for (size_t k = 0; k < SplatPictures::kSizes; ++k) {
    const double size = unit * std::exp2(static_cast<double>(k) - SplatPictures::kOctaves);
    SplatPictures::AtSize& at = pictures.sizes[k];
    ANCHORSPLAT_RETURN_IF_ERROR(painter.Outlines(size, RenderMode::kClassic, at.classic, &at.cut, &at.coarse));
    if (k % 2 == 0) continue;  // antialiased values hardly change from one octave to the next
    ANCHORSPLAT_RETURN_IF_ERROR(painter.Outlines(size, RenderMode::kAntialiased, at.antialiased, nullptr, nullptr));
  }
  constexpr double kNothing = 1e-7;  // keeps logarithms finite
  std::array<double, SplatPictures::kDetails + 1> luminance{}, alpha{};
  ANCHORSPLAT_RETURN_IF_ERROR(painter.Details(unit, luminance, alpha));
  for (size_t k = 0; k < SplatPictures::kDetails; ++k) {
    pictures.of_luminance[k] = std::log((luminance[k] + kNothing) / (luminance.back() + kNothing));
    pictures.of_alpha[k] = std::log((alpha[k] + kNothing) / (alpha.back() + kNothing));
  }
  return pictures;
}

}  // namespace anchorsplat
