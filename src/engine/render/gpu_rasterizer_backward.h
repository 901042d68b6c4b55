#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>

#include "core/image.h"
#include "core/result.h"
#include "gpu/device.h"
#include "render/blend_backward.h"
#include "render/gpu_cloud.h"
#include "render/gpu_layout.h"
#include "render/gpu_rasterizer.h"
#include "render/projected_gaussian.h"
#include "render/rasterizer.h"

namespace anchorsplat {

inline constexpr int64_t kMaxGpuSlots = int64_t{1} << 22;  // 208 MiB

// Conversions of data read back to the CPU's structs.
ProjectedGaussian FromGpu(const GpuSeen& seen);
BlendGradient FromGpu(const std::array<float, 12>& sums);

// ∂L/∂(color, alpha) of the last picture, on the GPU.
struct GpuPictureGradient {
  const GpuBuffer* pixels = nullptr;  // vec4f, row-major in the box: ∂L/∂C, ∂L/∂A
  PixelBox box;                       // within the picture; 0 outside
};

// Gradient of some rows of a cloud on the GPU, as in CloudGradient.
struct GpuGradient {
  size_t block = 0;          // the rows are in GpuCloud::Block(block)
  int64_t offset = 0;        // first row within that block, a multiple of kGpuWorkgroupSize
  int64_t first = 0;         // first row within the cloud
  int64_t count = 0;         // rows
  GpuMemory means;           // f32 [count,3] per world unit
  GpuMemory log_scales;      // f32 [count,3]
  GpuMemory quats;           // f32 [count,4] of the quaternion as stored
  GpuMemory opacity_logits;  // f32 [count]
  GpuMemory sh;              // f32 [count,K,3] as in the cloud
  GpuMemory means2d;         // f32 [count,2] per pixel
  GpuMemory means2d_abs;     // f32 [count,2]; only with RenderOptions::absgrad
};

// Gradient of a GpuRasterizer's last picture, drawn with RenderOptions::gradient: Rasterizer::Backward on a GPU,
// bit-identical in every run. Keeps its buffers: 52 bytes per Gaussian, 52 per slot of tiles processed at once (at most
// kMaxGpuSlots), and a GpuGradient.
class GpuRasterizerBackward {
 public:
  explicit GpuRasterizerBackward(GpuRasterizer& rasterizer) : rasterizer_(&rasterizer) {}

  // Computes the sums over all pixels, the input of Project. Waits for the GPU only if not all slots fit at once.
  // Errors: those of GpuDevice; no room for even the slots of one tile.
  Status Blend(const RenderOptions& options, const GpuPictureGradient& gradient);
  // The same with a gradient in host memory.
  Status Blend(const RenderOptions& options, const RenderGradient& gradient);

  // Computes the gradient of the drawn cloud, some rows at a time in order. `use` may record work that reads and
  // modifies these columns and those of the cloud; gradient columns are reused for the next rows. Errors: those of
  // GpuDevice and `use`.
  Status Project(GpuCloud& cloud, const RenderOptions& options, const std::function<Status(const GpuGradient&)>& use);

  // Reads Σ T·∂L/∂C after Blend. Errors: those of GpuDevice.
  Status ReadBackground(std::span<float, 3> background);
  // f32 [N,12]: the numbers of BlendGradient, two absolute sums, 0.
  const GpuBuffer& sums() const { return *sums_; }

 private:
  struct Run;
  Status MakeRoomForSums();
  Status Upload(const RenderGradient& gradient, int first_row, int last_row);
  void CountSlots(const Run& run);
  Status PlaceSlots(Run& run);
  void BlendRun(const RenderOptions& options, const Run& run);
  Status BlendAll(const RenderOptions& options, const GpuPictureGradient& gradient, const RenderGradient* host);
  Status ProjectUnusual(const GpuCloud& cloud, const RenderOptions& options, const GpuGradient& gradient);

  GpuRasterizer* rasterizer_;
  GpuMemory pixels_;                        // vec4f, uploaded from host memory
  GpuMemory sums_;                          // f32 [N,12]
  GpuMemory starts_;                        // u32 [N], scanned
  GpuMemory lengths_;                       // u32 [16]: N, for the scan
  GpuMemory totals_;                        // u32 [16]
  GpuMemory many_;                          // u32
  GpuMemory slots_;                         // f32 [slots] touched, f32 [slots,12]
  GpuMemory backgrounds_;                   // vec4f [T]
  int64_t first_tile_ = 0, last_tile_ = 0;  // tiles with backgrounds
  Buffer<float> staging_;
  GpuGradient gradient_;
};

}  // namespace anchorsplat
