#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/result.h"
#include "gpu/device.h"
#include "metrics/photometric_loss.h"

namespace anchorsplat {

// Where the three channels of a picture lie in a buffer of floats. Channels one after the other, as in Image: 1 and
// width × height.
struct GpuPicture {
  const GpuBuffer* buffer = nullptr;
  uint32_t pixel_stride = 1;    // floats from one pixel to the next, along the row and then down
  uint32_t channel_stride = 0;  // floats from one channel to the next
};

// A value of a target that says: of this pixel nothing is asked. It counts as equal to what is rendered there.
inline constexpr float kNotAsked = -1;

struct GpuPhotometricLossValue {
  PhotometricLossValue loss;
  double mean_square = 0;  // of the differences: −10·log10 of it is the PSNR in dB
};

// PhotometricLoss of pictures that are on the GPU, with a gradient that stays there: metrics/ssim.wgsl. Values and
// gradients are those of the CPU up to rounding, and the same bits at every run.
class GpuPhotometricLoss {
 public:
  explicit GpuPhotometricLoss(std::shared_ptr<GpuDevice> device) : device_(std::move(device)) {}

  // Records the comparison of two pictures of width × height pixels: `gradient` becomes ∂loss/∂rendered, everywhere.
  // Values below −0.5 of `wanted` ask for nothing (kNotAsked). Errors: those of PhotometricLoss, of
  // GpuDevice::Allocate; kBadArgument: a picture so large that a kernel does not see all of it.
  Status Compare(int width, int height, const GpuPicture& rendered, const GpuPicture& wanted,
                 const PhotometricLossOptions& options, const GpuPicture& gradient);

  // Of the last Compare; waits for it. Errors: those of GpuDevice::Read.
  Result<GpuPhotometricLossValue> Value();

 private:
  std::shared_ptr<GpuDevice> device_;
  GpuMemory maps_, sums_;
  std::vector<float> read_;
  int64_t tiles_ = 0;  // of the last Compare
  double values_ = 0, windows_ = 0, ssim_weight_ = 0;
};

}  // namespace anchorsplat
