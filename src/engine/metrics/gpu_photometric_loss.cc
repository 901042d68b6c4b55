#include "metrics/gpu_photometric_loss.h"

#include <algorithm>
#include <array>

#include "core/text.h"
#include "metrics/ssim.h"
#include "metrics/wgsl.h"

namespace anchorsplat {

namespace {

constexpr int kTileSide = 16;  // of a workgroup's tile, pixels
constexpr int64_t kColors = 3, kMaps = 3, kSums = 3;

const GpuKernel kSsimMaps = {"ssim_maps", {wgsl::kSsimWgsl}};
const GpuKernel kPhotometricGradient = {"photometric_gradient", {wgsl::kSsimWgsl}};

// Matches `Loss` in ssim.wgsl.
struct Parameters {
  std::array<uint32_t, 2> size, tiles;
  std::array<uint32_t, 4> map;
  std::array<uint32_t, 2> rendered, wanted, gradient, channels;
  float ssim_weight, difference_weight;
  std::array<float, 2> unused;
  std::array<float, 8> window;
};

}  // namespace

Status GpuPhotometricLoss::Compare(int width, int height, const GpuPicture& rendered, const GpuPicture& wanted,
                                   const PhotometricLossOptions& options, const GpuPicture& gradient) {
  ANCHORSPLAT_RETURN_IF_ERROR(CheckPhotometricLoss(width, height, options));
  const int64_t plane = int64_t{width} * height, of_a_channel = kMaps * plane;
  const uint64_t bytes = static_cast<uint64_t>(of_a_channel) * sizeof(float), seen = device_->adapter().max_binding;
  if (bytes > seen) {
    return Error{ErrorCode::kBadArgument,
                 Cat("pictures of ", width, " x ", height, " are too large for this GPU to compare")};
  }
  // No maps are needed without SSIM, but bindings cannot be empty.
  const bool similarity = options.ssim_weight > 0;
  const int64_t at_once = kColors * bytes <= seen ? kColors : 1;
  const int64_t tiles_x = (width + kTileSide - 1) / kTileSide, tiles_y = (height + kTileSide - 1) / kTileSide;
  const auto room = [&](GpuMemory& memory, int64_t floats, std::string_view what) {
    return EnsureGpuMemory(*device_, memory, static_cast<uint64_t>(floats) * sizeof(float), what);
  };
  ANCHORSPLAT_RETURN_IF_ERROR(room(maps_, similarity ? at_once * of_a_channel : 1, "maps of the loss"));
  ANCHORSPLAT_RETURN_IF_ERROR(room(sums_, kColors * tiles_x * tiles_y * kSums, "sums of the loss"));

  const bool valid = options.padding == SsimPadding::kValid;
  const int margin = valid ? kSsimRadius : 0;
  tiles_ = tiles_x * tiles_y;
  values_ = kColors * static_cast<double>(plane);
  windows_ = kColors * static_cast<double>(width - 2 * margin) * (height - 2 * margin);
  ssim_weight_ = options.ssim_weight;

  const auto strides = [](const GpuPicture& picture) {
    return std::array{picture.pixel_stride, picture.channel_stride};
  };
  Parameters p{};
  p.size = {static_cast<uint32_t>(width), static_cast<uint32_t>(height)};
  p.tiles = {static_cast<uint32_t>(tiles_x), static_cast<uint32_t>(tiles_y)};
  p.map = {static_cast<uint32_t>(margin), static_cast<uint32_t>(margin), static_cast<uint32_t>(width - margin),
           static_cast<uint32_t>(height - margin)};
  p.rendered = strides(rendered);
  p.wanted = strides(wanted);
  p.gradient = strides(gradient);
  p.ssim_weight = similarity ? static_cast<float>(-options.ssim_weight / windows_) : 0;
  p.difference_weight = static_cast<float>((1 - options.ssim_weight) / values_);
  std::copy_n(SsimWindow().begin(), kSsimRadius + 1, p.window.begin());
  const auto groups = static_cast<uint32_t>(at_once * tiles_);
  for (int64_t channel = 0; channel < kColors; channel += at_once) {
    p.channels = {static_cast<uint32_t>(channel), static_cast<uint32_t>(at_once)};
    if (similarity) {
      device_->Run(kSsimMaps, AsParameters(p),
                   {{1, rendered.buffer}, {2, wanted.buffer}, {3, maps_.get()}, {5, sums_.get()}}, groups);
    }
    device_->Run(kPhotometricGradient, AsParameters(p),
                 {{1, rendered.buffer}, {2, wanted.buffer}, {3, maps_.get()}, {4, gradient.buffer}, {5, sums_.get()}},
                 groups);
  }
  return {};
}

Result<GpuPhotometricLossValue> GpuPhotometricLoss::Value() {
  read_.resize(static_cast<size_t>(kColors * tiles_ * kSums));
  const GpuRead read = {sums_.get(), 0, std::as_writable_bytes(std::span(read_))};
  ANCHORSPLAT_RETURN_IF_ERROR(device_->Read({&read, 1}));
  std::array<double, kSums> sums{};
  for (size_t i = 0; i < read_.size(); ++i) sums[i % kSums] += static_cast<double>(read_[i]);
  GpuPhotometricLossValue value;
  value.loss.l1 = sums[1] / values_;
  value.loss.ssim = ssim_weight_ > 0 ? 1 - sums[0] / windows_ : 1;
  value.loss.loss = (1 - ssim_weight_) * value.loss.l1 + ssim_weight_ * (1 - value.loss.ssim);
  value.mean_square = sums[2] / values_;
  return value;
}

}  // namespace anchorsplat
