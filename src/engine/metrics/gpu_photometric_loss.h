#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/result.h"
#include "gpu/device.h"
#include "metrics/photometric_loss.h"

namespace anchorsplat {

// Layout of a three-channel image in a float buffer. Planar, as in Image: strides 1 and width × height.
struct GpuPicture {
  const GpuBuffer* buffer = nullptr;
  uint32_t pixel_stride = 1;    // in floats, to the next pixel (row-major)
  uint32_t channel_stride = 0;  // in floats, to the next channel
};

// Target value of pixels to ignore: they count as equal to the rendering.
inline constexpr float kIgnoredPixel = -1;

struct GpuPhotometricLossValue {
  PhotometricLossValue loss;
  double mean_square = 0;  // mean squared difference; PSNR in dB is −10·log10 of it
};

// PhotometricLoss for images on the GPU, with a gradient that stays there (metrics/ssim.wgsl). Matches the CPU up to
// rounding, and is bit-identical in every run.
class GpuPhotometricLoss {
 public:
  explicit GpuPhotometricLoss(std::shared_ptr<GpuDevice> device) : device_(std::move(device)) {}

  // Records a comparison of two images of width × height pixels; `gradient` receives ∂loss/∂rendered for all pixels.
  // Pixels of `wanted` below −0.5 are ignored (kIgnoredPixel). Errors: those of PhotometricLoss and
  // GpuDevice::Allocate; kBadArgument: an image too large for one binding.
  Status Compare(int width, int height, const GpuPicture& rendered, const GpuPicture& wanted,
                 const PhotometricLossOptions& options, const GpuPicture& gradient);

  // Result of the last Compare; waits for it. Errors: those of GpuDevice::Read.
  Result<GpuPhotometricLossValue> Value();

 private:
  std::shared_ptr<GpuDevice> device_;
  GpuMemory maps_, sums_;
  std::vector<float> read_;
  int64_t tiles_ = 0;  // of the last Compare
  double values_ = 0, windows_ = 0, ssim_weight_ = 0;
};

}  // namespace anchorsplat
