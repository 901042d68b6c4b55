#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "core/buffer.h"
#include "core/camera.h"
#include "core/stopwatch.h"
#include "render/bin.h"
#include "render/gradient_slots.h"
#include "render/projected_gaussian.h"
#include "render/rasterizer.h"

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
    RenderOptions options;
    int64_t count;
    int sh_degree;
  };
  std::optional<Kept> kept;  // where the last Render was asked to keep it
  Buffer<float> transmittance;
  Buffer<int32_t> contributors, radii;
  Buffer<int64_t> slot_counts, slot_starts;
  Buffer<BlendGradient> slot_sums, gradients;
  Buffer<float> slot_absolute;
  Buffer<uint8_t> slot_touched;
  Buffer<double> tile_backgrounds;

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
};

}  // namespace anchorsplat
