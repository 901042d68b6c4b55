#include "fit/gpu_objective.h"

#include <algorithm>
#include <array>
#include <span>
#include <utility>

#include "core/run_context.h"
#include "fit/wgsl.h"
#include "render/project.h"
#include "render/shown_range.h"

namespace anchorsplat {

namespace {

const GpuKernel kAverageRays = {"average_rays", {wgsl::kPixelModelWgsl}};
const GpuKernel kSpreadToRays = {"spread_to_rays", {wgsl::kPixelModelWgsl}};

const GpuKernel kUnpackPicture = {"unpack_picture", {wgsl::kTargetsWgsl}};

constexpr uint64_t kPartForTargets = 4;  // a fourth of the run's GPU memory may hold cached targets

// Struct `Rays` of pixel_model.wgsl.
struct RaysParameters {
  std::array<uint32_t, 2> size;
  uint32_t samples, plane;
};

// Struct `Bytes` of targets.wgsl.
struct UnpackParameters {
  std::array<float, 3> background;
  uint32_t plane, channels, masked;
  std::array<uint32_t, 2> unused;
};

}  // namespace

GpuObjective::GpuObjective(const std::shared_ptr<GpuDevice>& device)
    : device_(device),
      rasterizer_(device),
      backward_(rasterizer_),
      loss_(device),
      left_(MaxGpuMemoryOfRun() / kPartForTargets) {}

Result<bool> GpuObjective::Show(const ObjectiveOptions& options, GpuCloud& cloud, const WorldOrigin& origin,
                                const Camera& camera) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(options.pixel));
  render_ = RaysOf(options.pixel, options.render);
  render_.gradient = true;
  Camera rays = RaysOf(options.pixel, camera);
  ANCHORSPLAT_RETURN_IF_ERROR(ValidateRender(rays, render_));
  width_ = camera.intrinsics.width;
  height_ = camera.intrinsics.height;
  samples_ = options.pixel.samples;
  const int64_t plane = int64_t{width_} * height_;
  if (samples_ > 1) {
    ANCHORSPLAT_RETURN_IF_ERROR(
        EnsureGpuMemory(*device_, averages_, static_cast<uint64_t>(plane) * 3 * sizeof(float), "averages of rays"));
  }
  const float near = NearPlane(render_, rays);
  rays.world_to_camera = RelativeToOrigin(rays.world_to_camera, origin);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const bool drawn, rasterizer_.Draw(cloud, rays, near, render_, nullptr));
  if (!drawn || samples_ == 1) return drawn;
  const RaysParameters p = {{static_cast<uint32_t>(width_), static_cast<uint32_t>(height_)},
                            static_cast<uint32_t>(samples_),
                            RasterizedPlane()};
  device_->Run(kAverageRays, AsParameters(p), {{1, rasterizer_.picture.get()}, {2, averages_.get()}},
               GpuWorkgroups(3 * plane));
  return true;
}

uint32_t GpuObjective::RasterizedPlane() const {
  return static_cast<uint32_t>(int64_t{width_} * samples_ * TilesAcross(height_ * samples_) * kTile);
}

GpuPicture GpuObjective::Shown() const {
  if (samples_ > 1) return {averages_.get(), 1, static_cast<uint32_t>(width_ * height_)};
  return {rasterizer_.picture.get(), 1, RasterizedPlane()};
}

Result<const Image*> GpuObjective::Rendered() {
  if (rendered_.width != width_ || rendered_.height != height_) rendered_ = Image(width_, height_, 3);
  const GpuPicture shown = Shown();
  std::array<GpuRead, 3> reads;
  for (int c = 0; c < 3; ++c) {
    const std::span to(rendered_.channel(c), static_cast<size_t>(rendered_.plane()));
    reads[static_cast<size_t>(c)] = {shown.buffer, static_cast<uint64_t>(c) * shown.channel_stride * sizeof(float),
                                     std::as_writable_bytes(to)};
  }
  ANCHORSPLAT_RETURN_IF_ERROR(device_->Read(reads));
  return &std::as_const(rendered_);
}

Result<GpuObjective::Target*> GpuObjective::AllocateTarget(uint64_t bytes, std::optional<int64_t> view) {
  if (view && bytes <= left_) {
    Result<GpuMemory> made = device_->Allocate(bytes, "a picture to compare with");
    if (made.ok()) {
      left_ -= bytes;
      Target& target = kept_[*view];
      target.memory = std::move(made).value();
      return &target;
    }
    left_ = 0;  // leaves memory for everything else
  }
  ANCHORSPLAT_RETURN_IF_ERROR(EnsureGpuMemory(*device_, passing_.memory, bytes, "a picture to compare with"));
  return &passing_;
}

Status GpuObjective::SetTarget(const PackedPicture& picture, const std::array<float, 3>& background, int64_t view) {
  const size_t size = picture.pixels.size() + picture.ignored.size();
  staged_bytes_.assign((size + 3) / 4 * 4, 0);
  std::copy(picture.pixels.begin(), picture.pixels.end(), staged_bytes_.begin());
  std::copy(picture.ignored.begin(), picture.ignored.end(), staged_bytes_.begin() + std::ssize(picture.pixels));
  ANCHORSPLAT_ASSIGN_OR_RETURN(Target * target, AllocateTarget(staged_bytes_.size(), view));
  target->channels = picture.channels;
  target->masked = !picture.ignored.empty();
  target->background = background;
  device_->Write(*target->memory, 0, std::as_bytes(std::span(staged_bytes_)));
  return {};
}

Status GpuObjective::SetTarget(const Image& picture, const Buffer<uint8_t>& ignored, std::optional<int64_t> view) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(Target * target, AllocateTarget(picture.pixels.size() * sizeof(float), view));
  target->channels = 0;
  std::span<const float> values = picture.pixels;
  if (!ignored.empty()) {
    staging_.assign(values.begin(), values.end());
    const auto plane = static_cast<size_t>(picture.plane());
    for (size_t i = 0; i < staging_.size(); ++i) {
      if (ignored[i % plane] != 0) staging_[i] = kIgnoredPixel;
    }
    values = staging_;
  }
  device_->Write(*target->memory, 0, std::as_bytes(values));
  return {};
}

Result<const GpuBuffer*> GpuObjective::Unpack(const Target& target) {
  if (target.channels == 0) return &std::as_const(*target.memory);
  const int64_t plane = int64_t{width_} * height_;
  ANCHORSPLAT_RETURN_IF_ERROR(EnsureGpuMemory(*device_, unpacked_, static_cast<uint64_t>(plane) * 3 * sizeof(float),
                                              "a picture to compare with"));
  const UnpackParameters p = {target.background,
                              static_cast<uint32_t>(plane),
                              static_cast<uint32_t>(target.channels),
                              target.masked ? 1u : 0u,
                              {}};
  device_->Run(kUnpackPicture, AsParameters(p), {{1, target.memory.get()}, {2, unpacked_.get()}}, GpuWorkgroups(plane));
  return &std::as_const(*unpacked_);
}

Status GpuObjective::Compare(const ObjectiveOptions& options, GpuCloud& cloud, int64_t view,
                             const std::function<Status(const GpuGradient&)>& use) {
  const auto plane = static_cast<uint32_t>(width_ * height_);
  const auto rays = static_cast<uint32_t>(int64_t{plane} * samples_ * samples_);
  constexpr uint64_t kPixelBytes = 4 * sizeof(float);
  // New memory is zero, and the gradient of alpha, which the loss never sets, stays zero.
  ANCHORSPLAT_RETURN_IF_ERROR(EnsureGpuMemory(*device_, gradient_, plane * kPixelBytes, "the gradient of a picture"));
  if (samples_ > 1) {
    ANCHORSPLAT_RETURN_IF_ERROR(EnsureGpuMemory(*device_, rays_gradient_, rays * kPixelBytes, "the gradient of rays"));
  }
  const auto kept = kept_.find(view);
  ANCHORSPLAT_ASSIGN_OR_RETURN(const GpuBuffer* wanted, Unpack(kept == kept_.end() ? passing_ : kept->second));
  ANCHORSPLAT_RETURN_IF_ERROR(
      loss_.Compare(width_, height_, Shown(), {wanted, 1, plane}, options.loss, {gradient_.get(), 4, 1}));
  if (samples_ > 1) {
    const RaysParameters p = {
        {static_cast<uint32_t>(width_), static_cast<uint32_t>(height_)}, static_cast<uint32_t>(samples_), 0};
    device_->Run(kSpreadToRays, AsParameters(p), {{1, gradient_.get()}, {2, rays_gradient_.get()}},
                 GpuWorkgroups(rays));
  }
  const GpuPictureGradient of_picture = {samples_ > 1 ? rays_gradient_.get() : gradient_.get(),
                                         {0, 0, width_ * samples_, height_ * samples_}};
  ANCHORSPLAT_RETURN_IF_ERROR(backward_.Blend(render_, of_picture));
  return backward_.Project(cloud, render_, use);
}

}  // namespace anchorsplat
