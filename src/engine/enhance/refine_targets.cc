#include "enhance/refine_targets.h"

#include <algorithm>
#include <utility>

#include "core/parallel.h"
#include "enhance/enlarged_targets.h"
#include "metrics/image_metrics.h"

namespace anchorsplat {

namespace {

constexpr int kTargetRowsPerTask = 32;
constexpr float kNothing = 1.0f / 255;  // alpha invisible at 8 bits

bool IsWhole(const PixelBox& window, const Pinhole& size) { return window == PixelBox{0, 0, size.width, size.height}; }

}  // namespace

Buffer<uint8_t> FaintPixels(const Image& alpha) {
  const int width = alpha.width, height = alpha.height;
  Buffer<uint8_t> faint(static_cast<size_t>(alpha.plane()));
  // Horizontal pass: solid pixels within reach along the row.
  Buffer<uint8_t> solid(faint.size());
  ParallelFor(0, height, kTargetRowsPerTask, [&](int64_t first, int64_t last) {
    for (int64_t y = first; y < last; ++y) {
      const float* row = alpha.pixels.data() + y * width;
      for (int x = 0; x < width; ++x) {
        const int from = std::max(0, x - kFaintReach), to = std::min(width, x + kFaintReach + 1);
        solid[static_cast<size_t>(y * width + x)] = *std::max_element(row + from, row + to) >= kFaint;
      }
    }
  });
  ParallelFor(0, height, kTargetRowsPerTask, [&](int64_t first, int64_t last) {
    for (int64_t y = first; y < last; ++y) {
      const int64_t from = std::max<int64_t>(0, y - kFaintReach), to = std::min<int64_t>(height, y + kFaintReach + 1);
      for (int x = 0; x < width; ++x) {
        bool near_solid = false;
        for (int64_t k = from; k < to; ++k) near_solid |= solid[static_cast<size_t>(k * width + x)] != 0;
        const auto at = static_cast<size_t>(y * width + x);
        faint[at] = alpha.pixels[at] > kNothing && !near_solid;
      }
    }
  });
  if (std::none_of(faint.begin(), faint.end(), [](uint8_t f) { return f != 0; })) return {};
  return faint;
}

void CutOut(const Image& picture, const Buffer<uint8_t>& ignored, const PixelBox& window, RefineTarget& part) {
  CropInto(picture, window, part.picture);
  part.ignored.clear();
  if (ignored.empty()) return;
  part.ignored.resize(static_cast<size_t>(part.picture.plane()));
  for (int y = 0; y < part.picture.height; ++y) {
    std::copy_n(ignored.data() + int64_t{window.y0 + y} * picture.width + window.x0, part.picture.width,
                part.ignored.data() + int64_t{y} * part.picture.width);
  }
}

RefineTargets::RefineTargets(PictureCache pictures) : pictures_(std::move(pictures)) {}

RefineTargets::RefineTargets(std::unique_ptr<EnlargedTargets> enlarged) : enlarged_(std::move(enlarged)) {}

RefineTargets::RefineTargets(RefineTargets&&) noexcept = default;
RefineTargets& RefineTargets::operator=(RefineTargets&&) noexcept = default;
RefineTargets::~RefineTargets() = default;

RefineTargets::RefineTargets(std::shared_ptr<const GaussianCloud> splat, const RenderOptions& render,
                             std::vector<Camera> views)
    : splat_(std::move(splat)),
      still_(std::make_unique<ConstantCloud>(*splat_)),
      render_(render),
      views_(std::move(views)),
      kept_(views_.size()) {}

const std::vector<Camera>& RefineTargets::views() const {
  if (enlarged_) return enlarged_->views();
  return pictures_ ? pictures_->views() : views_;
}

void RefineTargets::LoadAhead(std::span<const int64_t> views) {
  if (enlarged_) enlarged_->LoadAhead(views);
  if (pictures_) pictures_->LoadAhead(views);
}

Status RefineTargets::Load(int64_t view, const PixelBox& window, RefineTarget& target) {
  if (enlarged_) return enlarged_->Load(view, window, target);
  const Camera& camera = views()[static_cast<size_t>(view)];
  const bool whole = IsWhole(window, camera.intrinsics);
  if (pictures_) {
    if (whole) return pictures_->Load(view, target.picture, target.ignored);
    Buffer<uint8_t> ignored;
    ANCHORSPLAT_RETURN_IF_ERROR(pictures_->Load(view, whole_, ignored));
    CutOut(whole_, ignored, window, target);
    return {};
  }
  RefineTarget& kept = kept_[static_cast<size_t>(view)];
  if (whole && kept.picture.width > 0) {
    target = kept;
    return {};
  }
  ANCHORSPLAT_RETURN_IF_ERROR(rasterizer_.Render(*still_, Crop(camera, window), render_, output_));
  target.picture = output_.color;
  Clamp01(target.picture);
  target.ignored = FaintPixels(output_.alpha);
  const auto bytes = static_cast<int64_t>(sizeof(float) * target.picture.pixels.size() + target.ignored.size());
  if (whole && bytes <= left_) {
    left_ -= bytes;
    kept = target;
  }
  return {};
}

}  // namespace anchorsplat
