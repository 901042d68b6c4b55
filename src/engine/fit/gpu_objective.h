#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <unordered_map>

#include "core/buffer.h"
#include "core/camera.h"
#include "core/image.h"
#include "core/result.h"
#include "fit/picture_cache.h"
#include "fit/view_objective.h"
#include "gpu/device.h"
#include "metrics/gpu_photometric_loss.h"
#include "render/gpu_cloud.h"
#include "render/gpu_rasterizer.h"
#include "render/gpu_rasterizer_backward.h"

namespace anchorsplat {

// ViewObjective for a cloud on the GPU. Measurements stay there until requested. Target pictures are uploaded once, as
// far as memory allows.
class GpuObjective {
 public:
  explicit GpuObjective(const std::shared_ptr<GpuDevice>& device);

  // As ViewObjective::Show. `origin`: that of the cloud's means. False: this picture must be rendered on the CPU
  // (GpuRasterizer::Draw). Errors: those of ValidateRender, PixelModel and GpuRasterizer.
  Result<bool> Show(const ObjectiveOptions& options, GpuCloud& cloud, const WorldOrigin& origin, const Camera& camera);
  // Picture of the last Show: [3,H,W]. Waits for it. Valid until the next call. Errors: those of GpuDevice::Read.
  Result<const Image*> Rendered();

  // Whether a target set for this view is still cached.
  bool Holds(int64_t view) const { return kept_.contains(view); }
  // Sets the target of the next Compare: a view's picture over `background`. Cached while there is room. Errors: those
  // of GpuDevice::Allocate.
  Status SetTarget(const PackedPicture& picture, const std::array<float, 3>& background, int64_t view);
  // The same for any picture [3,H,W]; `ignored` as in PictureCache::Load. Cached under `view`, if given.
  Status SetTarget(const Image& picture, const Buffer<uint8_t>& ignored, std::optional<int64_t> view = std::nullopt);

  // The two halves of ViewObjective::Compare for the last Show: the loss against the cached target of `view`, or else
  // the last target, and its gradient, passed to `use` in parts (GpuRasterizerBackward::Project). Errors: those of
  // both, before the first `use` unless the device failed.
  Status Compare(const ObjectiveOptions& options, GpuCloud& cloud, int64_t view,
                 const std::function<Status(const GpuGradient&)>& use);
  // [N,2] of the last picture, pixels, as CloudGradient::radii.
  const GpuBuffer& radii() const { return *rasterizer_.radii; }

  // Loss of the last Compare. Waits for it. Errors: those of GpuDevice::Read.
  Result<GpuPhotometricLossValue> Loss() { return loss_.Value(); }

 private:
  // A target picture: bytes as in PackedPicture, then the ignored mask; or floats.
  struct Target {
    GpuMemory memory;
    int channels = 0;  // of bytes; 0: floats
    bool masked = false;
    std::array<float, 3> background = {};
  };

  // Allocates `bytes` for a target: cached under `view`, or reused for the next one.
  Result<Target*> AllocateTarget(uint64_t bytes, std::optional<int64_t> view);
  Result<const GpuBuffer*> Unpack(const Target& target);
  uint32_t RasterizedPlane() const;  // stride between channels of the rasterizer's picture: whole tiles
  GpuPicture Shown() const;          // picture of the last Show, [H,W] pixels

  std::shared_ptr<GpuDevice> device_;
  GpuRasterizer rasterizer_;
  GpuRasterizerBackward backward_;
  GpuPhotometricLoss loss_;
  RenderOptions render_;  // of the last Show
  int width_ = 0, height_ = 0, samples_ = 1;
  GpuMemory averages_;       // f32 [3,H,W]
  GpuMemory gradient_;       // vec4f [H,W]
  GpuMemory rays_gradient_;  // vec4f [H·samples,W·samples]
  GpuMemory unpacked_;       // f32 [3,H,W]
  Target passing_;           // not cached
  std::unordered_map<int64_t, Target> kept_;
  uint64_t left_;  // remaining bytes for cached targets
  Buffer<float> staging_;
  Buffer<uint8_t> staged_bytes_;
  Image rendered_;
};

}  // namespace anchorsplat
