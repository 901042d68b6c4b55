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

// Target picture of a low-resolution view.
struct RefineTarget {
  Image picture;            // [3,H,W] of the window
  Buffer<uint8_t> ignored;  // [H,W] 1 = no target, as in masks; empty: none ignored
};

// Target views of a refinement: pictures, or ordinary renders of a splat. In renders, haze is ignored: pixels with
// alpha below kFaint and no pixel above it within kFaintReach. Be it a floater or a remnant, there is no detail to
// find. Pixels with zero alpha count: they keep the object from growing.
inline constexpr float kFaint = 0.3f;
inline constexpr int kFaintReach = 2;

// Copies `window` of a picture and of its ignored pixels (empty: none) to `part`.
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

  // Loads `window` of the target of views()[view]. Errors: those of PictureCache and Rasterizer.
  Status Load(int64_t view, const PixelBox& window, RefineTarget& target);

  // The pictures, or null if targets are rendered.
  PictureCache* pictures() { return pictures_ ? &*pictures_ : nullptr; }

  // Announces the next views, see PictureCache.
  void LoadAhead(std::span<const int64_t> views);

 private:
  static constexpr int64_t kBudget = int64_t{1} << 30;  // bytes of cached renders

  std::unique_ptr<EnlargedTargets> enlarged_;
  std::optional<PictureCache> pictures_;
  Image whole_;

  std::shared_ptr<const GaussianCloud> splat_;
  std::unique_ptr<ConstantCloud> still_;  // of splat_
  RenderOptions render_;
  std::vector<Camera> views_;
  std::vector<RefineTarget> kept_;  // cached whole views; empty: not rendered yet
  int64_t left_ = kBudget;
  Rasterizer rasterizer_;
  RenderOutput output_;
};

// 1 for pixels with 0 < alpha < kFaint without a pixel of at least kFaint within kFaintReach rows and columns. Empty if
// there are none.
Buffer<uint8_t> FaintPixels(const Image& alpha);

}  // namespace anchorsplat
