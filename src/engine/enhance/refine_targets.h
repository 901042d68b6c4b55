#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/buffer.h"
#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/image.h"
#include "core/result.h"
#include "fit/picture_cache.h"
#include "render/constant_cloud.h"
#include "render/rasterizer.h"

namespace anchorsplat {

// What a low-resolution view should show.
struct RefineTarget {
  Image picture;            // [3,H,W] of the window
  Buffer<uint8_t> ignored;  // [H,W] 1 where nothing is asked, as masks have it; empty: nowhere
};

// The views that a refinement compares with: pictures, or what a splat itself shows through cameras, rendered in the
// ordinary way. In the latter, haze is ignored: pixels with an alpha below kFaint around which (kFaintReach pixels)
// none is above it. Whether that is a floater or a remnant of something, there is no detail in it to find. Pixels
// without any alpha count: they keep the object from growing.
inline constexpr float kFaint = 0.3f;
inline constexpr int kFaintReach = 2;

// The part `window` of a picture and of what is ignored in it (empty: nothing), which has its size.
void CutOut(const Image& picture, const Buffer<uint8_t>& ignored, const PixelBox& window, RefineTarget& part);

class EnlargedTargets;

class RefineTargets {
 public:
  explicit RefineTargets(PictureCache pictures);
  explicit RefineTargets(std::unique_ptr<EnlargedTargets> enlarged);  // enhance/enlarged_targets.h
  RefineTargets(std::shared_ptr<const GaussianCloud> splat, const RenderOptions& render, std::vector<Camera> views);
  RefineTargets(RefineTargets&&) noexcept;
  RefineTargets& operator=(RefineTargets&&) noexcept;
  ~RefineTargets();

  const std::vector<Camera>& views() const;

  // The part `window`, within the picture, of what views()[view] should show. Errors: those of PictureCache and
  // Rasterizer.
  Status Load(int64_t view, const PixelBox& window, RefineTarget& target);

  // Those that it has instead of what a splat shows, or null.
  PictureCache* pictures() { return pictures_ ? &*pictures_ : nullptr; }

  // `views` are asked for next, see PictureCache.
  void LoadAhead(std::span<const int64_t> views);

 private:
  static constexpr int64_t kBudget = int64_t{1} << 30;  // bytes of rendered targets that are kept

  std::unique_ptr<EnlargedTargets> enlarged_;
  std::optional<PictureCache> pictures_;
  Image whole_;

  std::shared_ptr<const GaussianCloud> splat_;
  std::unique_ptr<ConstantCloud> still_;  // of it
  RenderOptions render_;
  std::vector<Camera> views_;
  std::vector<RefineTarget> kept_;  // of whole pictures; empty ones are not there yet
  int64_t left_ = kBudget;
  Rasterizer rasterizer_;
  RenderOutput output_;
};

// 1 for pixels with 0 < alpha < kFaint that have no pixel of at least kFaint within kFaintReach rows and columns.
// Empty when there is none.
Buffer<uint8_t> FaintPixels(const Image& alpha);

}  // namespace anchorsplat
