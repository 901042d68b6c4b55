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

// What is read back, as the CPU has it.
ProjectedGaussian FromGpu(const GpuSeen& seen);
BlendGradient FromGpu(const std::array<float, 12>& sums);

// ∂L/∂(color, alpha) of the last picture, on the GPU.
struct GpuPictureGradient {
  const GpuBuffer* pixels = nullptr;  // vec4f, row by row of the box: ∂L/∂C, ∂L/∂A
  PixelBox box;                       // within the picture; it counts as 0 outside
};

// ∂L/∂ of some rows of a cloud, on the GPU: what CloudGradient holds of them.
struct GpuGradient {
  size_t block = 0;          // of the cloud: GpuCloud::Block(block) has the rows
  int64_t offset = 0;        // of the first row in that block, a multiple of kGpuGroup
  int64_t first = 0;         // the same row in the cloud
  int64_t count = 0;         // rows
  GpuMemory means;           // f32 [count,3] per world unit
  GpuMemory log_scales;      // f32 [count,3]
  GpuMemory quats;           // f32 [count,4] of the quaternion as stored
  GpuMemory opacity_logits;  // f32 [count]
  GpuMemory sh;              // f32 [count,K,3] as the cloud's
  GpuMemory means2d;         // f32 [count,2] per pixel
  GpuMemory means2d_abs;     // f32 [count,2]; none unless RenderOptions::absgrad asks for it
};

// The gradient of a GpuRasterizer's last picture, which was drawn with RenderOptions::gradient: the twin of
// Rasterizer::Backward, with the same bits at every run. Keeps its buffers: 52 bytes per Gaussian, 52 per slot of the
// tiles that are done at once (at most kMaxGpuSlots), and a GpuGradient.
class GpuRasterizerBackward {
 public:
  explicit GpuRasterizerBackward(GpuRasterizer& rasterizer) : rasterizer_(&rasterizer) {}

  // The sums over all pixels, from where Project goes on. Waits for the GPU only where the slots of all tiles are too
  // many to be there at once. Errors: of GpuDevice; not even room for the slots of a tile.
  Status Blend(const RenderOptions& options, const GpuPictureGradient& gradient);
  // The same of a gradient in host memory.
  Status Blend(const RenderOptions& options, const RenderGradient& gradient);

  // The gradient of the cloud that was drawn, some rows at a time and in order: `use` may record work with the columns
  // and with the cloud's own, and change these; they are used again for the next rows. Errors: of GpuDevice and of
  // `use`.
  Status Project(GpuCloud& cloud, const RenderOptions& options, const std::function<Status(const GpuGradient&)>& use);

  // Σ T·∂L/∂C, after Blend. Errors: of GpuDevice.
  Status ReadBackground(std::span<float, 3> background);
  // [N,12] f32: the numbers of BlendGradient, two absolute sums, 0.
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
  GpuMemory pixels_;                        // vec4f, of a gradient in host memory
  GpuMemory sums_;                          // f32 [N,12]
  GpuMemory starts_;                        // u32 [N], scanned
  GpuMemory lengths_;                       // u32 [16]: N, for the scan
  GpuMemory totals_;                        // u32 [16]
  GpuMemory many_;                          // u32
  GpuMemory slots_;                         // f32 [slots] touched, f32 [slots,12]
  GpuMemory backgrounds_;                   // vec4f [T]
  int64_t first_tile_ = 0, last_tile_ = 0;  // that have backgrounds
  Buffer<float> staging_;
  GpuGradient gradient_;
};

}  // namespace anchorsplat
