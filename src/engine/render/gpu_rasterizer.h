#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/camera.h"
#include "core/result.h"
#include "gpu/device.h"
#include "render/gpu_cloud.h"
#include "render/gpu_layout.h"
#include "render/gpu_sort.h"
#include "render/rasterizer.h"

namespace anchorsplat {

// Rasterizer on a GPU: the same steps and arithmetic, the same picture up to rounding, bit-identical in every run.
// Keeps its buffers, 120 bytes per Gaussian and 16 per pair, so that the next picture need not allocate.
//
// The host reads back twice: the pairs per tile, to choose runs of tiles as EndOfRun does, and the picture. State of
// the last picture is public, as the backward pass continues from it.
class GpuRasterizer {
 public:
  explicit GpuRasterizer(std::shared_ptr<GpuDevice> on) : device(std::move(on)) {}

  // Draws the cloud like Rasterizer::Render, with arguments it has validated. `camera` is in the cloud's own space
  // (RelativeToOrigin), `near` the near plane. Draws to `output` or, if null, to `picture`.
  //
  // Returns false if the camera needs the CPU's doubles. Errors: exceeds the device's limits or the run's memory, or
  // the device failed; nothing is drawn.
  Result<bool> Draw(GpuCloud& cloud, const Camera& camera, float near, const RenderOptions& options,
                    RenderOutput* output);

  // One of several pictures drawn without host readback in between.
  struct Picture {
    const Camera& camera;  // as for Draw
    float near;
    RenderOutput& output;  // shaped
    bool drawn = false;    // false: it does not fit or needs the CPU; use Draw
    int64_t visible = 0, total_pairs = 0;
  };
  // Draws pictures of a resident cloud, without data for gradients, bit-identical to Draw. The host waits once for all.
  // Each picture has memory for `pairs` pairs. Errors: those of Draw; nothing is drawn.
  Status DrawTogether(GpuCloud& cloud, std::span<Picture> pictures, const RenderOptions& options, int64_t pairs);
  // Bytes that DrawTogether needs per picture of this size.
  static uint64_t BytesTogether(const Pinhole& intrinsics, const RenderOptions& options);
  void ForgetTogether() { together.reset(); }

  // Writes the lists of tiles [first, last), a run that EndOfRun allows, to `pairs[listed]` and `ranges`.
  void ListRun(int64_t first, int64_t last);
  // End of the longest run from `first`, up to `end`, whose lists fit in `pairs`; at least one tile.
  int64_t EndOfRun(int64_t first, int64_t end) const;

  // Pixels per plane of `picture`: whole rows of tiles, so slightly more than the picture's.
  int64_t PlanePixels() const { return tile_rows_per_band * kTile * int64_t{view.size[0]}; }

  const std::shared_ptr<GpuDevice> device;

  // State of the last picture; shapes in render/gpu_layout.h.
  GpuView view{};  // `counts` are set per dispatch
  int64_t count = 0, tile_count = 0;
  int64_t visible = 0, total_pairs = 0;
  int64_t most_tiles = 0;  // upper bound of the tiles of all rectangles, some of which are in no list
  int runs = 0;
  std::vector<int64_t> tile_offsets;  // [T+1] first pair of each tile over all runs
  GpuMemory seen, rects, radii, sizes, ranges, picture, kept;
  std::array<GpuMemory, 2> rows;              // rows[0] is `order`; rows[1] and keys are scratch
  std::array<GpuMemory, 2> keys;              // u32 [N]
  std::array<GpuMemory, 2> pairs, pair_keys;  // u32 [pair_capacity]
  size_t listed = 0;                          // index in `pairs`
  int64_t listed_first = 0, listed_last = 0;  // tiles of that run
  int64_t pair_capacity = 0, run_pairs = 0;   // capacity; maximum of one run
  std::vector<int64_t> unusual_rows;          // ascending: rows left to the CPU (render/unusual.wgsl)

 private:
  bool MakeView(const GpuCloud& cloud, const Camera& camera, float near, const RenderOptions& options);
  Status MakeRoom(bool whole_picture);
  void Project(GpuCloud& cloud);
  void SortAndCount();
  Status ReadCounts();
  Status ProjectOnCpu(const GpuCloud& cloud, const Camera& camera, float near, const RenderOptions& options);
  Status MakeRoomForPairs(GpuCloud& cloud, int64_t max_pairs);
  Status RoomForPairs(int64_t wanted);
  void DropSpare();
  void RecordAhead(GpuCloud& cloud, int64_t most_pairs, int64_t most_slots, int64_t report);
  void VisitTiles(int64_t first, int64_t last, GpuBinStep step, uint64_t at_most);
  void Blend(int64_t first, int64_t last, int64_t band_row);
  Status ReadPicture(int64_t band_row, bool depth, RenderOutput& output);

  GpuMemory unusual;      // u32 [1+N]: render/unusual.wgsl
  GpuMemory places;       // u32 [GpuScanBytes(N) / 4]
  GpuMemory tables;       // u32, scratch of sorts
  GpuMemory totals;       // u32 [16], scratch of scans
  GpuMemory tile_counts;  // u32 [T]
  GpuMemory reports;      // vec4u, from DrawTogether: render/tile_ranges.wgsl
  GpuMemory together;     // f32, pictures of DrawTogether, planar
  uint32_t unusual_count = 0;
  bool counts_are_of_all = false;  // `places` has unscanned pair counts of the whole picture
  int64_t tile_rows_per_band = 0;  // rows in `picture`: all, or a band of a picture read band by band
};

}  // namespace anchorsplat
