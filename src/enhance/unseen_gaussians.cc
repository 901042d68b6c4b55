#include "enhance/unseen_gaussians.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <utility>

#include "core/activations.h"
#include "core/framing.h"
#include "core/random.h"
#include "core/spherical_harmonics.h"
#include "core/text.h"
#include "metrics/image_metrics.h"
#include "render/rasterizer.h"

namespace anchorsplat {

namespace {

constexpr size_t kMostViews = 48;
constexpr int kMostPixels = 512;  // a side
constexpr int kOrbitViews = 24;
constexpr int kBisections = 8;
// α is capped at 0.999, where no gradient flows. Opacities are lowered below that while gradients are taken.
constexpr float kHighestOpacity = 0.98f;

std::vector<Camera> ChooseViews(const std::vector<Camera>& cameras) {
  std::vector<Camera> views;
  const size_t count = std::min(kMostViews, cameras.size());
  for (size_t k = 0; k < count; ++k) {
    Camera camera = cameras[k * cameras.size() / count];
    const int longest = std::max(camera.intrinsics.width, camera.intrinsics.height);
    if (longest > kMostPixels) camera.intrinsics = Scaled(camera.intrinsics, double{kMostPixels} / longest);
    views.push_back(std::move(camera));
  }
  return views;
}

bool IsLikeBackground(const GaussianCloud& cloud, int64_t i, const std::array<float, 3>& background) {
  const float* sh = cloud.sh.data() + i * cloud.sh_stride();
  for (size_t c = 0; c < 3; ++c) {
    const float colour = std::max(0.0f, 0.5f + kSh0 * sh[c]);
    if (!(std::abs(colour - background[c]) <= kLikeBackground)) return false;
  }
  return true;
}

// What every Gaussian adds to the views, in squares, by the gradient of the picture times random signs.
Result<std::vector<double>> Additions(GaussianCloud cloud, const std::vector<Camera>& views, RenderOptions options,
                                      uint64_t seed) {
  for (float& logit : cloud.opacity_logits) logit = std::min(logit, LogitFromOpacity(kHighestOpacity));
  options.gradient = true;
  std::vector<double> additions(static_cast<size_t>(cloud.size()));
  Rasterizer rasterizer;
  RenderOutput output;
  RenderGradient signs;
  CloudGradient gradient;
  Random random(seed);
  for (const Camera& camera : views) {
    ANCHORSPLAT_RETURN_IF_ERROR(rasterizer.Render(cloud, camera, options, output));
    signs.color = output.color;
    signs.box = {0, 0, camera.intrinsics.width, camera.intrinsics.height};
    for (float& sign : signs.color.pixels) sign = random.Below(2) == 0 ? -1.0f : 1.0f;
    ANCHORSPLAT_RETURN_IF_ERROR(rasterizer.Backward(cloud, signs, gradient));
    for (size_t i = 0; i < additions.size(); ++i) {
      // o·∂L/∂o = ∂L/∂logit / (1 − o), the sum of sign·T·α·(colour − behind) over the pixels.
      const double sum = gradient.opacity_logits[i] / (1 - double{Sigmoid(cloud.opacity_logits[i])});
      additions[i] += sum * sum;
    }
  }
  return additions;
}

// How the views look without some of the Gaussians.
class Comparison {
 public:
  static Result<Comparison> Make(const GaussianCloud& cloud, std::vector<Camera> views, const RenderOptions& options) {
    Comparison comparison(cloud, std::move(views), options);
    for (const Camera& camera : comparison.views_) {
      ANCHORSPLAT_RETURN_IF_ERROR(comparison.Render(camera));
      comparison.before_.push_back(comparison.output_.color);
    }
    return comparison;
  }

  // PSNR of all views together without `gone` against with them.
  Result<double> PsnrWithout(std::span<const int64_t> gone) {
    Buffer<float> kept(gone.size());
    for (size_t k = 0; k < gone.size(); ++k) {
      kept[k] = std::exchange(cloud_.opacity_logits[static_cast<size_t>(gone[k])], kInvisible);
    }
    const Result<double> psnr = Together();
    for (size_t k = 0; k < gone.size(); ++k) cloud_.opacity_logits[static_cast<size_t>(gone[k])] = kept[k];
    return psnr;
  }

 private:
  static constexpr float kInvisible = -std::numeric_limits<float>::infinity();

  Comparison(const GaussianCloud& cloud, std::vector<Camera> views, const RenderOptions& options)
      : cloud_(cloud), views_(std::move(views)), options_(options) {}

  Status Render(const Camera& camera) {
    ANCHORSPLAT_RETURN_IF_ERROR(rasterizer_.Render(cloud_, camera, options_, output_));
    Clamp01(output_.color);
    return {};
  }

  Result<double> Together() {
    double squares = 0, values = 0;
    for (size_t k = 0; k < views_.size(); ++k) {
      ANCHORSPLAT_RETURN_IF_ERROR(Render(views_[k]));
      ANCHORSPLAT_ASSIGN_OR_RETURN(const double psnr, Psnr(before_[k], output_.color));
      const auto count = static_cast<double>(output_.color.pixels.size());
      squares += count * std::pow(10, -psnr / 10);
      values += count;
    }
    return -10 * std::log10(squares / values);
  }

  GaussianCloud cloud_;
  std::vector<Camera> views_;
  RenderOptions options_;
  std::vector<Image> before_;
  Rasterizer rasterizer_;
  RenderOutput output_;
};

}  // namespace

Result<UnseenGaussians> FindUnseen(const GaussianCloud& cloud, const std::vector<Camera>& cameras,
                                   const UnseenOptions& options) {
  if (!(options.least_psnr > 0)) {
    return Error{ErrorCode::kBadArgument, Cat("a least PSNR of ", options.least_psnr, " dB is not positive")};
  }
  std::vector<Camera> views = ChooseViews(cameras);
  if (views.empty()) {
    const Framing framing = FrameCloud(cloud);
    const Pinhole intrinsics = PinholeFromFov(kMostPixels, kMostPixels, std::numbers::pi / 4);
    ANCHORSPLAT_ASSIGN_OR_RETURN(const CameraSet orbit, OrbitCameras(kOrbitViews, FramingDistance(framing, intrinsics),
                                                                     framing.target, intrinsics));
    views = orbit.cameras;
  }
  RenderOptions render;
  render.mode = cloud.render_mode.value_or(RenderMode::kClassic);
  render.background = options.background;
  UnseenGaussians found;
  found.views = static_cast<int64_t>(views.size());
  found.psnr = std::numeric_limits<double>::infinity();
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<double> additions, Additions(cloud, views, render, options.seed));
  std::vector<int64_t> candidates;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    const bool counts = IsUsable(cloud, i) && std::isfinite(additions[static_cast<size_t>(i)]);
    if (counts && IsLikeBackground(cloud, i, options.background)) candidates.push_back(i);
  }
  std::ranges::stable_sort(candidates, {}, [&](int64_t i) { return additions[static_cast<size_t>(i)]; });
  ANCHORSPLAT_ASSIGN_OR_RETURN(Comparison comparison, Comparison::Make(cloud, std::move(views), render));
  // The most of them, in this order, without which the views change by no more.
  size_t enough = 0, too_many = candidates.size() + 1, count = candidates.size();
  for (int k = 0; k <= kBisections && enough + 1 < too_many; ++k, count = (enough + too_many) / 2) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const double psnr, comparison.PsnrWithout(std::span(candidates).first(count)));
    if (psnr >= options.least_psnr) {
      enough = count;
      found.psnr = psnr;
    } else {
      too_many = count;
    }
  }
  found.rows.assign(candidates.begin(), candidates.begin() + static_cast<std::ptrdiff_t>(enough));
  std::ranges::sort(found.rows);
  return found;
}

}  // namespace anchorsplat
