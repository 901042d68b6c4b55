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
#include "render/gpu_cloud.h"
#include "render/gpu_rasterizer.h"
#include "render/gpu_rasterizer_backward.h"
#include "render/gradient_slots.h"
#include "render/project.h"
#include "render/projected_gaussian.h"
#include "render/rasterizer.h"
#include "render/spherical_harmonics.h"
#include "render/still_cloud.h"

namespace anchorsplat {

// Only ever grows, so that a warm rasterizer does not allocate; the old contents are not kept.
template <typename T>
T* Room(Buffer<T>& buffer, int64_t size) {
  const size_t needed = static_cast<size_t>(size);
  if (buffer.size() < needed) {
    buffer.clear();  // nothing to copy to the new place
    buffer.resize(needed + needed / 8);
  }
  return buffer.data();
}

// What the first two steps of a picture are given; where their results go is left open.
ProjectParams ProjectInputs(const CloudView& cloud, const Camera& camera, float near, const RenderOptions& options);
SphericalHarmonicsParams SphericalHarmonicsInputs(const CloudView& cloud, const Camera& camera,
                                                  const RenderOptions& options);

// RenderOptions::min_transmittance, but no less than where T would lose its digits, from which the backward pass
// recovers what it was in front.
inline float LeastTransmittance(const RenderOptions& options) { return std::max(options.min_transmittance, 1e-30f); }

// Gives the pictures the sizes of what is drawn.
void ShapeFor(const Camera& camera, const RenderOptions& options, RenderOutput& output);

// What is drawn: arrays, or those of a splat that does not change, whose copy on a GPU is its own.
struct Rasterizer::Subject {
  const CloudView& cloud;
  StillCloud* still = nullptr;
};

// The buffers of a Rasterizer.
struct Rasterizer::State {
  Buffer<ProjectedGaussian> projected;
  Buffer<TileRect> tiles, tiles_by_depth;
  Buffer<int32_t> visible, visible_counts, rows, spare_rows, pairs;
  Buffer<uint32_t> keys, spare_keys, histograms, chunk_counts;
  Buffer<int64_t> visible_starts, tile_offsets, evaluations;
  RenderStatistics statistics;

  // For the backward pass, which also needs most of the above.
  struct Kept {
    Pinhole intrinsics;
    Pose world_to_camera;
    std::array<double, 3> center;
    float near;  // plane
    RenderOptions options;
    int64_t count;
    int sh_degree;
    bool on_gpu;  // by `gpu`, which has what the CPU would have below
  };
  std::optional<Kept> kept;  // where the last Render was asked to keep it
  std::unique_ptr<GpuRasterizer> gpu;
  GpuCloud gpu_cloud;                                   // what `gpu` drew last, unless that is a StillCloud's
  std::unique_ptr<GpuRasterizerBackward> gpu_backward;  // of `gpu`, once it is needed
  Buffer<float> transmittance;
  Buffer<int32_t> contributors, radii;
  Buffer<int64_t> slot_counts, slot_starts;
  Buffer<BlendGradient> slot_sums, gradients;
  Buffer<float> slot_absolute;
  Buffer<uint8_t> slot_touched;
  Buffer<double> tile_backgrounds;

  // `gpu`, as the run has one now.
  GpuRasterizer* OpenGpu();
  // What is drawn, on it. Errors: of GpuCloud::Assign.
  Result<GpuCloud*> Upload(const Subject& subject);
  // A picture, by one or the other. False: not by the GPU, because the run has none, because it needs doubles, or
  // because it failed, after which the run has none.
  bool DrawOnGpu(const Subject& subject, const Camera& camera, float near, const RenderOptions& options,
                 RenderOutput& output);
  void DrawOnCpu(const CloudView& cloud, const Camera& camera, float near, const RenderOptions& options,
                 RenderOutput& output);
  // How many of the cameras, from the first one on, can be drawn together on the GPU: 0, or at least two.
  size_t CountTogether(StillCloud& cloud, std::span<const Camera> cameras, const RenderOptions& options);
  int64_t PairsTogether(const StillCloud& cloud, const RenderOptions& options) const;

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
  // How the sums of the tiles are to be added up after the last run of tiles.
  struct SlotsLeft {
    SlotsParams params;
    GradientSlots slots;
  };
  // Background, and where there is more than one run of tiles, `gradients` and means2d_abs.
  std::optional<SlotsLeft> BlendBackward(const RenderGradient& output_gradient, CloudGradient& gradient);
  void ProjectBackward(const std::optional<SlotsLeft>& left, const CloudView& cloud, const CoefficientStep* step,
                       CloudGradient& gradient);
  Buffer<float> sh_gradients;  // [N,K,3] of the GPU, where they take a step

  // What the GPU drew, once more by the CPU, which has then kept what it needs.
  void DrawAgainOnCpu(const Subject& subject);
  // Errors: of GpuRasterizerBackward. Then nothing has changed that cannot be calculated again.
  Status BackwardOnGpu(const Subject& subject, const RenderGradient& output_gradient, const CoefficientStep* step,
                       CloudGradient& gradient);
  Status BackwardToSeenOnGpu(const RenderGradient& output_gradient);
  void BackwardToSeenOnCpu(const RenderGradient& output_gradient);
};

}  // namespace anchorsplat
