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

// ViewObjective of a cloud that stays on the GPU. What it measures stays there, too, until somebody asks; what pictures
// should show is uploaded once, as far as there is room for it.
class GpuObjective {
 public:
  explicit GpuObjective(const std::shared_ptr<GpuDevice>& device);

  // As ViewObjective::Show, of a cloud whose means are from `origin` on. False: this picture is one for the CPU
  // (GpuRasterizer::Draw). Errors: those of ValidateRender, PixelModel and GpuRasterizer.
  Result<bool> Show(const ObjectiveOptions& options, GpuCloud& cloud, const WorldOrigin& origin, const Camera& camera);
  // What the last Show drew: [3,H,W]. Waits for it. Valid until the next call. Errors: those of GpuDevice::Read.
  Result<const Image*> Rendered();

  // Whether SetTarget was called for this view and what it brought is still there.
  bool Holds(int64_t view) const { return kept_.contains(view); }
  // What the next Compare compares with: the picture of a view over `background`, which is kept as long as there is
  // room. Errors: those of GpuDevice::Allocate.
  Status SetTarget(const PackedPicture& picture, const std::array<float, 3>& background, int64_t view);
  // The same of any picture [3,H,W]; `ignored` as of PictureCache::Load. Kept for `view`, where there is one.
  Status SetTarget(const Image& picture, const Buffer<uint8_t>& ignored, std::optional<int64_t> view = std::nullopt);

  // The two halves of ViewObjective::Compare, with the cloud of the last Show: the loss against what is held of `view`
  // or, if that is nothing, against the last target, and its gradient, which is given to `use` in parts
  // (GpuRasterizerBackward::Project). Errors: those of both, before the first `use` unless the device has failed.
  Status Compare(const ObjectiveOptions& options, GpuCloud& cloud, int64_t view,
                 const std::function<Status(const GpuGradient&)>& use);
  // [N,2] of the last picture, pixels, as of CloudGradient::radii.
  const GpuBuffer& radii() const { return *rasterizer_.radii; }

  // Of the last Compare. Waits for it. Errors: those of GpuDevice::Read.
  Result<GpuPhotometricLossValue> Loss() { return loss_.Value(); }

 private:
  // A picture to compare with: bytes as those of a PackedPicture, then what is ignored; or floats.
  struct Target {
    GpuMemory memory;
    int channels = 0;  // of bytes; 0: floats
    bool masked = false;
    std::array<float, 3> background = {};
  };

  // Room for `bytes` of a target: kept for `view` or used again for the next one.
  Result<Target*> RoomForTarget(uint64_t bytes, std::optional<int64_t> view);
  Result<const GpuBuffer*> Unpack(const Target& target);
  uint32_t RasterizedPlane() const;  // numbers from one channel of the rasterizer's picture to the next: whole tiles
  GpuPicture Shown() const;          // what the last Show drew, of [H,W] pixels

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
  Target passing_;           // of no view, or of one for which there is no room
  std::unordered_map<int64_t, Target> kept_;
  uint64_t left_;  // bytes for more of them
  Buffer<float> staging_;
  Buffer<uint8_t> staged_bytes_;
  Image rendered_;
};

}  // namespace anchorsplat
