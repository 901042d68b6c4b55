#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>

#include "core/buffer.h"
#include "core/camera.h"
#include "core/stopwatch.h"
#include "render/bin.h"
#include "render/constant_cloud.h"
#include "render/gpu_cloud.h"
#include "render/gpu_rasterizer.h"
#include "render/gpu_rasterizer_backward.h"
#include "render/gradient_slots.h"
#include "render/project.h"
#include "render/projected_gaussian.h"
#include "render/rasterizer.h"
#include "render/spherical_harmonics.h"

namespace anchorsplat {

// Returns memory for `size` elements, growing the buffer if needed (contents are lost), so that a warm rasterizer does
// not allocate.
template <typename T>
T* Room(Buffer<T>& buffer, int64_t size) {
  const size_t needed = static_cast<size_t>(size);
  if (buffer.size() < needed) {
    buffer.clear();  // avoids copying
    buffer.resize(needed + needed / 8);
  }
  return buffer.data();
}

// Inputs of the first two steps of a picture; outputs are unset.
ProjectParams ProjectInputs(const CloudView& cloud, const Camera& camera, float near, const RenderOptions& options);
SphericalHarmonicsParams SphericalHarmonicsInputs(const CloudView& cloud, const Camera& camera,
                                                  const RenderOptions& options);

// RenderOptions::min_transmittance, raised to where T keeps its precision, which the backward pass needs to recover T.
inline float MinTransmittance(const RenderOptions& options) { return std::max(options.min_transmittance, 1e-30f); }

// Resizes the output images.
void ShapeFor(const Camera& camera, const RenderOptions& options, RenderOutput& output);

// The cloud to draw: arrays, or a constant cloud with its own GPU copy.
struct Rasterizer::Source {
  const CloudView& cloud;
  ConstantCloud* constant = nullptr;
};

// Buffers of a Rasterizer.
struct Rasterizer::State {
  Buffer<ProjectedGaussian> projected;
  Buffer<TileRect> tiles, tiles_by_depth;
  Buffer<int32_t> visible, visible_counts, rows, spare_rows, pairs;
  Buffer<uint32_t> keys, spare_keys, histograms, chunk_counts;
  Buffer<int64_t> visible_starts, tile_offsets, evaluations;
  RenderStatistics statistics;

  // Data for the backward pass, which also needs most of the above.
  struct Kept {
    Pinhole intrinsics;
    Pose world_to_camera;
    std::array<double, 3> center;
    float near;  // plane
    RenderOptions options;
    int64_t count;
    int sh_degree;
    bool on_gpu;  // drawn by `gpu`, which has the data that the CPU would have below
  };
  std::optional<Kept> kept;  // if the last Render had RenderOptions::gradient
  std::unique_ptr<GpuRasterizer> gpu;
  GpuCloud gpu_cloud;                                   // last cloud drawn by `gpu`, except constant clouds
  std::unique_ptr<GpuRasterizerBackward> gpu_backward;  // for `gpu`, created on demand
  Buffer<float> transmittance;
  Buffer<int32_t> contributors, radii;
  Buffer<int64_t> slot_counts, slot_starts;
  Buffer<BlendGradient> slot_sums, gradients;
  Buffer<float> slot_absolute;
  Buffer<uint8_t> slot_touched;
  Buffer<double> tile_backgrounds;

  // Returns `gpu` for the run's current device.
  GpuRasterizer* OpenGpu();
  // Uploads the cloud. Errors: those of GpuCloud::Assign.
  Result<GpuCloud*> Upload(const Source& source);
  // Draws a picture on the GPU or CPU. DrawOnGpu returns false if the run has no GPU, the picture needs doubles, or the
  // GPU fails; the run then gives it up.
  bool DrawOnGpu(const Source& source, const Camera& camera, float near, const RenderOptions& options,
                 RenderOutput& output);
  void DrawOnCpu(const CloudView& cloud, const Camera& camera, float near, const RenderOptions& options,
                 RenderOutput& output);
  // How many of the leading cameras can be drawn together on the GPU: 0, or at least two.
  size_t CountTogether(ConstantCloud& cloud, std::span<const Camera> cameras, const RenderOptions& options);
  int64_t PairsTogether(const ConstantCloud& cloud, const RenderOptions& options) const;

  void DropGpu() {
    gpu_backward.reset();
    gpu_cloud = GpuCloud();
    gpu.reset();
  }

  int64_t Project(const CloudView& cloud, const Camera& camera, float near, const RenderOptions& options,
                  Stopwatch& watch);
  void Sort(int64_t count, int64_t total);
  BinParams MakeBinParams(int64_t visible_total, const Pinhole& intrinsics, float min_alpha);
  void BinAndBlend(int64_t visible_total, const Camera& camera, const RenderOptions& options, RenderOutput& output,
                   Stopwatch& watch);
  // How to add up the sums of the last run of tiles.
  struct SlotsLeft {
    SlotsParams params;
    GradientSlots slots;
  };
  // Computes the background's gradient and, with several runs of tiles, `gradients` and means2d_abs.
  std::optional<SlotsLeft> BlendBackward(const RenderGradient& output_gradient, CloudGradient& gradient);
  void ProjectBackward(const std::optional<SlotsLeft>& left, const CloudView& cloud, const CoefficientStep* step,
                       CloudGradient& gradient);
  Buffer<float> sh_gradients;  // [N,K,3] from the GPU, if a step is taken

  // Redraws the GPU's picture on the CPU, with data for the backward pass.
  void DrawAgainOnCpu(const Source& source);
  // Errors: those of GpuRasterizerBackward. Nothing has changed then that cannot be recomputed.
  Status BackwardOnGpu(const Source& source, const RenderGradient& output_gradient, const CoefficientStep* step,
                       CloudGradient& gradient);
  Status BackwardToAppearanceOnGpu(const RenderGradient& output_gradient);
  void BackwardToAppearanceOnCpu(const RenderGradient& output_gradient);
};

}  // namespace anchorsplat
