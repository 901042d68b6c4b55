#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/buffer.h"
#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/image.h"
#include "core/result.h"
#include "enhance/refine_targets.h"
#include "render/constant_cloud.h"
#include "render/rasterizer.h"
#include "upscale/upscaler.h"

namespace anchorsplat {

// Checks that a network of scale `scale` can enlarge by `factor`: as many passes as do not exceed it, then bicubic
// interpolation for the rest; or one pass averaged down, if its scale is a multiple of the factor. Errors
// (kBadArgument):
// a factor below the scale that does not divide it, or above kMostSamples.
Status CheckFactor(int factor, int scale);

// Corrects `enlarged` [3,H·u,W·u] so that its averages over u × u pixels approach `low` [3,H,W]: one step of
// back-projection (Irani and Peleg 1991) with bicubic enlargement. Clamps to 0–1.
Status ProjectBack(const Image& low, Image& enlarged);

// Views u times larger than a refinement's: renderings of `start`, projected back onto the view so that at its own
// resolution it is unchanged. With a network each is blended with the network's enlargement (share kNetworkShare)
// before. The network knows how edges look but not what is there; the splat's share keeps detail on which all views
// agree.
class EnlargedTargets {
 public:
  // `upscaler`: null for none. `start`: the splat to refine. `render`: how it is rendered. `factor`: u.
  EnlargedTargets(RefineTargets low, std::shared_ptr<Upscaler> upscaler, int factor,
                  std::shared_ptr<const GaussianCloud> start, const RenderOptions& render);

  const std::vector<Camera>& views() const { return views_; }

  // As RefineTargets::Load, for the larger views. Errors: those of it and of Upscaler::Enlarge.
  Status Load(int64_t view, const PixelBox& window, RefineTarget& target);
  void LoadAhead(std::span<const int64_t> views) { low_.LoadAhead(views); }

 private:
  // A cached large view, rounded to bytes.
  struct Kept {
    bool has_room = false;    // fits the budget as a whole; true for the first views
    Buffer<uint8_t> pixels;   // [3,H,W]; empty: not made yet
    Buffer<uint8_t> ignored;  // as RefineTarget::ignored
  };
  static constexpr int64_t kBudget = int64_t{1} << 30;  // bytes of cached views
  static constexpr float kNetworkShare = 0.3f;
  static constexpr int kMargin = 16;  // low-resolution pixels around a window, for views not cached as a whole

  // Makes the larger view's part for `low_window` of the low one, into made_.
  Status Make(int64_t view, const PixelBox& low_window);

  RefineTargets low_;
  std::shared_ptr<Upscaler> upscaler_;
  int factor_;
  std::shared_ptr<const GaussianCloud> start_;
  std::unique_ptr<ConstantCloud> still_;  // of start_
  RenderOptions render_;
  std::vector<Camera> views_;
  std::vector<Kept> kept_;
  Rasterizer rasterizer_;
  RenderOutput output_;
  RefineTarget low_target_, made_;  // made_: of a window, or of a whole view to be cached
};

}  // namespace anchorsplat
