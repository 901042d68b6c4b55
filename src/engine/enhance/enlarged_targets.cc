#include "enhance/enlarged_targets.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/text.h"
#include "fit/pixel_model.h"
#include "metrics/bicubic.h"
#include "metrics/image_metrics.h"
#include "upscale/enlarge_picture.h"

namespace anchorsplat {

namespace {

PixelBox WholeOf(const Camera& camera) { return {0, 0, camera.intrinsics.width, camera.intrinsics.height}; }

// Enlarges [3,H,W] to [3,H·factor,W·factor], clamped to 0–1.
Result<Image> EnlargeBy(Upscaler& upscaler, const Image& low, int factor) {
  const int scale = upscaler.info().scale;
  int reached = scale;
  while (reached * scale <= factor) reached *= scale;
  ANCHORSPLAT_ASSIGN_OR_RETURN(Image image, EnlargePicture(upscaler, low, {.factor = reached}));
  if (reached == factor) return image;
  Image out;
  if (reached > factor) {
    AverageRays(image, reached / factor, out);
  } else {
    ANCHORSPLAT_ASSIGN_OR_RETURN(out, EnlargeBicubic(image, low.width * factor, low.height * factor));
    Clamp01(out);
  }
  return out;
}

}  // namespace

Status CheckFactor(int factor, int scale) {
  if (factor >= 1 && factor <= kMostSamples && (factor >= scale || scale % factor == 0)) return {};
  return Error{ErrorCode::kBadArgument,
               Cat("--enlarge-with: a network for ", scale, "x cannot add detail at --upscale ", factor)};
}

Status ProjectBack(const Image& low, Image& enlarged) {
  Image lacking;
  AverageRays(enlarged, enlarged.width / low.width, lacking);
  for (size_t i = 0; i < lacking.pixels.size(); ++i) lacking.pixels[i] = low.pixels[i] - lacking.pixels[i];
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Image added, EnlargeBicubic(lacking, enlarged.width, enlarged.height));
  for (size_t i = 0; i < added.pixels.size(); ++i) enlarged.pixels[i] += added.pixels[i];
  Clamp01(enlarged);
  return {};
}

EnlargedTargets::EnlargedTargets(RefineTargets low, std::shared_ptr<Upscaler> upscaler, int factor,
                                 std::shared_ptr<const GaussianCloud> start, const RenderOptions& render)
    : low_(std::move(low)),
      upscaler_(std::move(upscaler)),
      factor_(factor),
      start_(std::move(start)),
      still_(std::make_unique<ConstantCloud>(*start_)),
      render_(render),
      kept_(low_.views().size()) {
  int64_t left = kBudget;
  for (size_t i = 0; i < kept_.size(); ++i) {
    views_.push_back(RaysOf(PixelModel{factor}, low_.views()[i]));
    const int64_t pixels = int64_t{views_[i].intrinsics.width} * views_[i].intrinsics.height;
    kept_[i].has_room = 4 * pixels <= left;
    if (kept_[i].has_room) left -= 4 * pixels;
  }
}

Status EnlargedTargets::Make(int64_t view, const PixelBox& low_window) {
  ANCHORSPLAT_RETURN_IF_ERROR(low_.Load(view, low_window, low_target_));
  const int u = factor_;
  const PixelBox window = {low_window.x0 * u, low_window.y0 * u, low_window.x1 * u, low_window.y1 * u};
  const Camera camera = Crop(views_[static_cast<size_t>(view)], window);
  ANCHORSPLAT_RETURN_IF_ERROR(rasterizer_.Render(*still_, camera, render_, output_));
  Clamp01(output_.color);
  made_.picture = output_.color;
  if (upscaler_ != nullptr) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Image enlarged, EnlargeBy(*upscaler_, low_target_.picture, factor_));
    for (size_t i = 0; i < enlarged.pixels.size(); ++i) {
      made_.picture.pixels[i] = std::lerp(made_.picture.pixels[i], enlarged.pixels[i], kNetworkShare);
    }
  }
  ANCHORSPLAT_RETURN_IF_ERROR(ProjectBack(low_target_.picture, made_.picture));
  made_.ignored.clear();
  if (low_target_.ignored.empty()) return {};
  made_.ignored.resize(static_cast<size_t>(made_.picture.plane()));
  for (int y = 0; y < made_.picture.height; ++y) {
    const uint8_t* from = low_target_.ignored.data() + int64_t{y / u} * low_target_.picture.width;
    uint8_t* to = made_.ignored.data() + int64_t{y} * made_.picture.width;
    for (int x = 0; x < made_.picture.width; ++x) to[x] = from[x / u];
  }
  return {};
}

Status EnlargedTargets::Load(int64_t view, const PixelBox& window, RefineTarget& target) {
  const PixelBox low = WholeOf(low_.views()[static_cast<size_t>(view)]);
  Kept& kept = kept_[static_cast<size_t>(view)];
  const int width = window.x1 - window.x0, height = window.y1 - window.y0;
  if (!kept.has_room) {
    const PixelBox around = {std::max(low.x0, window.x0 / factor_ - kMargin),
                             std::max(low.y0, window.y0 / factor_ - kMargin),
                             std::min(low.x1, (window.x1 + factor_ - 1) / factor_ + kMargin),
                             std::min(low.y1, (window.y1 + factor_ - 1) / factor_ + kMargin)};
    ANCHORSPLAT_RETURN_IF_ERROR(Make(view, around));
    const int x0 = window.x0 - around.x0 * factor_, y0 = window.y0 - around.y0 * factor_;
    CutOut(made_.picture, made_.ignored, {x0, y0, x0 + width, y0 + height}, target);
    return {};
  }
  const int whole_width = low.x1 * factor_, whole_height = low.y1 * factor_;
  if (kept.pixels.empty()) {
    ANCHORSPLAT_RETURN_IF_ERROR(Make(view, low));
    kept.pixels.resize(made_.picture.pixels.size());
    std::transform(made_.picture.pixels.begin(), made_.picture.pixels.end(), kept.pixels.begin(),
                   [](float value) { return static_cast<uint8_t>(std::lround(255 * value)); });
    kept.ignored = made_.ignored;
  }
  if (target.picture.width != width || target.picture.height != height) target.picture = Image(width, height, 3);
  target.ignored.resize(kept.ignored.empty() ? 0 : static_cast<size_t>(target.picture.plane()));
  for (int y = 0; y < height; ++y) {
    const int64_t from = int64_t{window.y0 + y} * whole_width + window.x0, to = int64_t{y} * width;
    for (int c = 0; c < 3; ++c) {
      const uint8_t* bytes = kept.pixels.data() + int64_t{c} * whole_width * whole_height + from;
      std::transform(bytes, bytes + width, target.picture.channel(c) + to,
                     [](uint8_t byte) { return static_cast<float>(byte) / 255.0f; });
    }
    if (!kept.ignored.empty()) std::copy_n(kept.ignored.data() + from, width, target.ignored.data() + to);
  }
  return {};
}

}  // namespace anchorsplat
