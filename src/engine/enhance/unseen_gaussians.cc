#include "enhance/unseen_gaussians.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <span>
#include <utility>

#include "core/activations.h"
#include "core/cloud_view.h"
#include "core/framing.h"
#include "core/log.h"
#include "core/parallel.h"
#include "core/random.h"
#include "core/run_context.h"
#include "core/spherical_harmonics.h"
#include "core/text.h"
#include "metrics/image_metrics.h"
#include "render/constant_cloud.h"
#include "render/rasterizer.h"
#include "render/shown_range.h"

namespace anchorsplat {

namespace {

constexpr size_t kMostCleanViews = 48;
constexpr int kMostCleanPixels = 512;  // a side
constexpr int kOrbitViews = 24;
constexpr int kPredictingViews = 8, kPredictingPixels = 128;
constexpr double kPredictedPsnr = 75;
constexpr double kReachesViews = 0.01;  // of its unoccluded footprint
constexpr int kMostTrials = 10;
constexpr int64_t kRowsAtOnce = 1 << 14;
constexpr double kCloseEnough = 0.01;  // relative tolerance of the number removed
// α is capped at 0.999, where gradients vanish. So opacities are limited while gradients are computed.
constexpr float kHighestOpacity = 0.98f;

Result<std::vector<Camera>> ViewsAround(const GaussianCloud& cloud, int count, int pixels) {
  const Framing framing = FrameCloud(cloud);
  const Pinhole intrinsics = PinholeFromFov(pixels, pixels, std::numbers::pi / 4);
  ANCHORSPLAT_ASSIGN_OR_RETURN(CameraSet orbit,
                               OrbitCameras(count, FramingDistance(framing, intrinsics), framing.target, intrinsics));
  return std::move(orbit.cameras);
}

Result<std::vector<Camera>> ChooseViews(const GaussianCloud& cloud, const std::vector<Camera>& cameras) {
  if (cameras.empty()) return ViewsAround(cloud, kOrbitViews, kMostCleanPixels);
  std::vector<Camera> views;
  const size_t count = std::min(kMostCleanViews, cameras.size());
  for (size_t k = 0; k < count; ++k) {
    Camera camera = cameras[k * cameras.size() / count];
    const int longest = std::max(camera.intrinsics.width, camera.intrinsics.height);
    if (longest > kMostCleanPixels) {
      camera.intrinsics = Scaled(camera.intrinsics, double{kMostCleanPixels} / longest);
    }
    views.push_back(std::move(camera));
  }
  return views;
}

bool IsLikeBackground(const float* constant_term, const std::array<float, 3>& background) {
  for (size_t c = 0; c < 3; ++c) {
    const float colour = std::clamp(ColorFromDc(constant_term[c]), 0.0f, 1.0f);
    if (!(std::abs(colour - background[c]) <= kLikeBackground)) return false;
  }
  return true;
}

// Rows of usable Gaussians with the background's colour, ascending. `constant_terms`: SH DC, [3] every `stride` floats.
std::vector<int64_t> RowsLikeBackground(const GaussianCloud& cloud, const Buffer<float>& constant_terms, int64_t stride,
                                        const std::array<float, 3>& background) {
  std::vector<std::vector<int64_t>> parts(static_cast<size_t>((cloud.size() + kRowsAtOnce - 1) / kRowsAtOnce));
  ParallelFor(0, cloud.size(), kRowsAtOnce, [&](int64_t first, int64_t last) {
    std::vector<int64_t>& part = parts[static_cast<size_t>(first / kRowsAtOnce)];
    for (int64_t i = first; i < last; ++i) {
      if (IsLikeBackground(constant_terms.data() + i * stride, background) && IsUsable(cloud, i)) part.push_back(i);
    }
  });
  std::vector<int64_t> rows;
  for (const std::vector<int64_t>& part : parts) rows.insert(rows.end(), part.begin(), part.end());
  return rows;
}

Error Stopped() { return Error{ErrorCode::kInterrupted, "stopped while cleaning"}; }

// Contributions of some Gaussians to the views, from gradients of the picture with random signs.
struct Shown {
  std::vector<double> additions;   // Σ (T·α·(its colour − what is behind it))²; negative if no view draws it
  std::vector<double> reaches;     // Σ (T·α)²; 0 where its colour is clamped
  std::vector<double> footprints;  // Σ o² over its ellipse: about `reaches` without occlusion
  bool anything = false;           // whether a view draws any Gaussian

  // Whether it is almost entirely occluded in the views.
  bool IsHidden(size_t k) const { return !(reaches[k] > kReachesViews * footprints[k]); }
};

Result<Shown> FindShown(CloudView cloud, const std::vector<int64_t>& rows, const std::vector<Camera>& views,
                        RenderOptions options, uint64_t seed) {
  Buffer<float> logits(cloud.opacity_logits.begin(), cloud.opacity_logits.end());
  for (float& logit : logits) logit = std::min(logit, LogitFromOpacity(kHighestOpacity));
  cloud.opacity_logits = logits;
  options.gradient = true;
  Shown shown{.additions = std::vector<double>(rows.size(), -1.0),
              .reaches = std::vector<double>(rows.size()),
              .footprints = std::vector<double>(rows.size())};
  ConstantCloud still(cloud);
  Rasterizer rasterizer;
  RenderOutput output;
  RenderGradient signs;
  Random random(seed);
  Progress progress("find invisible Gaussians", static_cast<int64_t>(views.size()));
  for (const Camera& camera : views) {
    if (StopRequested()) return Stopped();
    ANCHORSPLAT_RETURN_IF_ERROR(rasterizer.Render(still, camera, options, output));
    shown.anything = shown.anything || rasterizer.statistics().visible > 0;
    signs.color = output.color;
    signs.box = {0, 0, camera.intrinsics.width, camera.intrinsics.height};
    for (float& sign : signs.color.pixels) sign = random.Below(2) == 0 ? -1.0f : 1.0f;
    ANCHORSPLAT_ASSIGN_OR_RETURN(const AppearanceGradient gradient, rasterizer.BackwardToAppearance(cloud, signs));
    ParallelFor(0, std::ssize(rows), kRowsAtOnce, [&](int64_t first, int64_t last) {
      for (auto k = static_cast<size_t>(first); k < static_cast<size_t>(last); ++k) {
        const int64_t i = rows[k];
        const int32_t* radii = gradient.radii.data() + 2 * i;
        if (radii[0] <= 0) continue;
        // Σ over pixels of sign·T·α·(colour − behind).
        const double sum = gradient.OfLogOpacity(i);
        shown.additions[k] = std::max(shown.additions[k], 0.0) + sum * sum;
        for (size_t c = 0; c < 3; ++c) {
          const double of_colour = gradient.OfColor(i, c);
          shown.reaches[k] += of_colour * of_colour / 3;
        }
        // ∫ exp(−r²/σ²) up to 3 σ.
        const double opacity = Sigmoid(double{logits[static_cast<size_t>(i)]});
        shown.footprints[k] += opacity * opacity * std::numbers::pi * (radii[0] / 3.0) * (radii[1] / 3.0);
      }
    });
    progress.Advance();
  }
  return shown;
}

// Compares views without some of the Gaussians with the full ones.
class Comparison {
 public:
  static Result<Comparison> Make(const GaussianCloud& cloud, std::vector<Camera> views, const RenderOptions& options) {
    Comparison comparison(cloud, std::move(views), options);
    ANCHORSPLAT_RETURN_IF_ERROR(comparison.Render([&](size_t, RenderOutput& output) -> Status {
      comparison.before_.push_back(std::move(output.color));
      return {};
    }));
    return comparison;
  }

  // PSNR of the worst view without `gone`, dB.
  Result<double> PsnrWithout(std::span<const int64_t> gone) {
    for (const int64_t i : gone) logits_[static_cast<size_t>(i)] = -std::numeric_limits<float>::infinity();
    const Result<double> psnr = WorstPsnr();
    for (const int64_t i : gone) {
      logits_[static_cast<size_t>(i)] = cloud_->opacity_logits[static_cast<size_t>(i)];
    }
    return psnr;
  }

 private:
  Comparison(const GaussianCloud& cloud, std::vector<Camera> views, const RenderOptions& options)
      : cloud_(&cloud), logits_(cloud.opacity_logits), views_(std::move(views)), options_(options) {}

  Status Render(const std::function<Status(size_t, RenderOutput&)>& use) {
    CloudView view(*cloud_);
    view.opacity_logits = logits_;
    ConstantCloud still(view);
    return rasterizer_.RenderEach(still, views_, options_, [&](size_t k, RenderOutput& output) -> Status {
      if (StopRequested()) return Stopped();
      Clamp01(output.color);
      return use(k, output);
    });
  }

  Result<double> WorstPsnr() {
    double worst = std::numeric_limits<double>::infinity();
    ANCHORSPLAT_RETURN_IF_ERROR(Render([&](size_t k, const RenderOutput& output) -> Status {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const double psnr, Psnr(before_[k], output.color));
      worst = std::min(worst, psnr);
      return {};
    }));
    return worst;
  }

  const GaussianCloud* cloud_;
  Buffer<float> logits_;
  std::vector<Camera> views_;
  RenderOptions options_;
  std::vector<Image> before_;
  Rasterizer rasterizer_;
};

// Indices of Gaussians drawn in some view, smallest contribution first.
std::vector<size_t> Candidates(const Shown& shown) {
  std::vector<size_t> candidates;
  for (size_t k = 0; k < shown.additions.size(); ++k) {
    if (shown.additions[k] >= 0 && std::isfinite(shown.additions[k])) candidates.push_back(k);
  }
  return candidates;
}
void SortByAddition(const Shown& shown, std::vector<size_t>& candidates) {
  std::ranges::stable_sort(candidates, {}, [&](size_t k) { return shown.additions[k]; });
}

// How many candidates' contributions sum up to `most`, ignoring interactions.
size_t Predicted(const std::vector<size_t>& candidates, const Shown& shown, double most) {
  double sum = 0;
  size_t count = 0;
  while (count < candidates.size()) {
    sum += shown.additions[candidates[count]];
    if (sum > most) break;
    ++count;
  }
  return count;
}

}  // namespace

Result<UnseenGaussians> FindUnseen(const GaussianCloud& cloud, const std::vector<Camera>& cameras,
                                   const UnseenOptions& options) {
  if (!(options.least_psnr > 0)) {
    return Error{ErrorCode::kBadArgument, Cat("a least PSNR of ", options.least_psnr, " dB is not positive")};
  }
  for (const float channel : options.background) {
    if (!(channel >= 0 && channel <= 1)) {
      return Error{ErrorCode::kBadArgument, Cat("the background's ", channel, " is not from 0 to 1")};
    }
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(std::vector<Camera> views, ChooseViews(cloud, cameras));
  RenderOptions render = DisplayOptions(cloud);
  render.background = options.background;
  const std::vector<int64_t> like = RowsLikeBackground(cloud, cloud.sh, cloud.sh_stride(), options.background);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Shown shown, FindShown(cloud, like, views, render, options.seed));
  if (!shown.anything) {
    return Error{ErrorCode::kBadArgument,
                 Cat("cleaning: none of ", views.size(),
                     " views shows any of the splat. Pass the cameras of this splat, in its unit and axes")};
  }
  std::vector<size_t> order = Candidates(shown);
  SortByAddition(shown, order);
  std::vector<int64_t> candidates;
  for (const size_t k : order) candidates.push_back(like[k]);
  UnseenGaussians found;
  found.views = static_cast<int64_t>(views.size());
  double values = 0;
  for (const Camera& camera : views) values += 3.0 * camera.intrinsics.width * camera.intrinsics.height;
  found.psnr = std::numeric_limits<double>::infinity();
  ANCHORSPLAT_ASSIGN_OR_RETURN(Comparison comparison, Comparison::Make(cloud, std::move(views), render));
  size_t enough = 0, too_many = candidates.size() + 1;
  // Initial guess: what all views together allow, about the maximum for the worst view.
  size_t count = Predicted(order, shown, values * std::pow(10, -options.least_psnr / 10));
  Progress progress("verify", kMostTrials);
  for (int trial = 0; trial < kMostTrials && enough + 1 < too_many; ++trial) {
    if (static_cast<double>(too_many - enough) <= kCloseEnough * static_cast<double>(enough)) break;
    if (count <= enough || count >= too_many) count = (enough + too_many) / 2;
    ANCHORSPLAT_ASSIGN_OR_RETURN(const double psnr, comparison.PsnrWithout(std::span(candidates).first(count)));
    if (psnr >= options.least_psnr) {
      enough = count;
      found.psnr = psnr;
    } else {
      too_many = count;
    }
    progress.Advance();
  }
  found.rows.assign(candidates.begin(), candidates.begin() + static_cast<std::ptrdiff_t>(enough));
  std::ranges::sort(found.rows);
  return found;
}

Result<std::vector<int64_t>> PredictUnseen(const GaussianCloud& cloud) {
  constexpr std::array<float, 3> kBlack{};
  // Slightly brighter than black, where the gradient tells how much of each reaches the views.
  Buffer<float> colours(3 * cloud.opacity_logits.size());
  ParallelFor(0, cloud.size(), kRowsAtOnce, [&](int64_t first, int64_t last) {
    for (int64_t i = first; i < last; ++i) {
      for (int64_t c = 0; c < 3; ++c) {
        colours[static_cast<size_t>(3 * i + c)] =
            std::max(cloud.sh[static_cast<size_t>(i * cloud.sh_stride() + c)], DcFromColor(1e-4f));
      }
    }
  });
  const std::vector<int64_t> dark = RowsLikeBackground(cloud, colours, 3, kBlack);
  if (dark.empty()) return std::vector<int64_t>();
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<Camera> views,
                               ViewsAround(cloud, kPredictingViews, kPredictingPixels));
  CloudView view(cloud);
  view.sh_degree = 0;
  view.sh = colours;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Shown shown, FindShown(view, dark, views, DisplayOptions(cloud), /*seed=*/0));
  std::vector<size_t> order = Candidates(shown);
  // Most of a large splat is occluded; such Gaussians add nothing to the sum and would be excluded below anyway.
  std::erase_if(order, [&](size_t k) { return shown.additions[k] == 0 && shown.IsHidden(k); });
  SortByAddition(shown, order);
  double values = 0;
  for (const Camera& camera : views) values += 3.0 * camera.intrinsics.width * camera.intrinsics.height;
  order.resize(Predicted(order, shown, values * std::pow(10, -kPredictedPsnr / 10)));
  std::vector<int64_t> rows;
  for (const size_t k : order) {
    if (!shown.IsHidden(k)) rows.push_back(dark[k]);
  }
  std::ranges::sort(rows);
  return rows;
}

}  // namespace anchorsplat
