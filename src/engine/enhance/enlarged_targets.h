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

// How a network's passes make a picture `factor` times larger: as many as do not go beyond it, then cubic convolution
// for the rest, or one pass averaged down where the network's own scale is a multiple of the factor. Errors
// (kBadArgument): a factor below the network's scale that does not divide it, or above kMostSamples.
Status CheckFactor(int factor, int scale);

// Adds to `enlarged` [3,H·u,W·u] what its averages over u × u pixels lack of `low` [3,H,W], enlarged by cubic
// convolution: back-projection (Irani and Peleg 1991), once. Clamped to 0 to 1 afterwards.
Status ProjectBack(const Image& low, Image& enlarged);

// Views u times larger than those of a refinement: in part (kInvented) what a network that enlarges pictures makes of
// them, in part what `start` shows there, projected back onto the view, so that at its own resolution it is what it
// was. The network knows what edges look like and not what is there; the splat's own part keeps detail that all views
// agree on.
class EnlargedTargets {
 public:
  // `start`, `render`: what is refined, and how. `factor`: u.
  EnlargedTargets(RefineTargets low, std::shared_ptr<Upscaler> upscaler, int factor,
                  std::shared_ptr<const GaussianCloud> start, const RenderOptions& render);

  const std::vector<Camera>& views() const { return views_; }

  // As RefineTargets::Load, of larger views. Errors: those, and Upscaler::Enlarge's.
  Status Load(int64_t view, const PixelBox& window, RefineTarget& target);
  void LoadAhead(std::span<const int64_t> views) { low_.LoadAhead(views); }

 private:
  // Rounded to bytes: what is kept of many large views.
  struct Kept {
    bool has_room = false;    // whether there is room for the whole picture: the first ones have
    Buffer<uint8_t> pixels;   // [3,H,W]; empty: not made yet
    Buffer<uint8_t> ignored;  // as RefineTarget's
  };
  static constexpr int64_t kBudget = int64_t{1} << 30;  // bytes that are kept
  static constexpr float kInvented = 0.3f;
  static constexpr int kMargin = 16;  // pixels of the low view around a window, where a view is not kept as a whole

  // What the larger view shows where the low one has `low_window`, into made_.
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
  RefineTarget low_target_, made_;  // made_: of a window, or of a picture that is about to be kept
};

}  // namespace anchorsplat
