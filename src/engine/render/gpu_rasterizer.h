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

// The twin of Rasterizer on a GPU: the same steps and arithmetic, the same picture but for rounding, the same bits at
// every run. Keeps its buffers, 120 bytes per Gaussian and 16 per pair, so that the next picture need not allocate.
//
// The host looks on twice: at the pairs per tile, from which it chooses runs of tiles as EndOfRun does, and at the
// picture. What the last picture left on the GPU is public, as the backward pass goes on from there.
class GpuRasterizer {
 public:
  explicit GpuRasterizer(std::shared_ptr<GpuDevice> on) : device(std::move(on)) {}

  // Draws the cloud as Rasterizer::Render does, whose checks the arguments have passed; `camera` is one of the cloud's
  // own space (FromOrigin) and `near` the near plane. To `output` or, where that is null, to `picture`.
  //
  // False: this picture is one for the CPU, whose doubles its camera needs. Errors: it does not fit the device's limits
  // or the run's memory, or the device has failed; nothing is drawn.
  Result<bool> Draw(GpuCloud& cloud, const Camera& camera, float near, const RenderOptions& options,
                    RenderOutput* output);

  // One of several pictures that are drawn without a look of the host in between.
  struct Picture {
    const Camera& camera;  // as of Draw
    float near;
    RenderOutput& output;  // shaped
    bool drawn = false;    // false: it does not fit, or needs the CPU, and Draw has to see to it
    int64_t visible = 0, total_pairs = 0;
  };
  // Draws pictures of a resident cloud, without what a gradient needs, with the bits that they have by Draw. The host
  // waits once, for all of them; each may have `pairs` pairs, for which there is memory. Errors: as of Draw; nothing is
  // drawn.
  Status DrawTogether(GpuCloud& cloud, std::span<Picture> pictures, const RenderOptions& options, int64_t pairs);
  // Bytes that DrawTogether takes for a picture of this size.
  static uint64_t BytesTogether(const Pinhole& intrinsics, const RenderOptions& options);
  void ForgetTogether() { together.reset(); }

  // The lists of tiles [first, last) to `pairs[listed]` and `ranges`, where EndOfRun allows that many.
  void ListRun(int64_t first, int64_t last);
  // The longest run from `first` on, not beyond `end`, whose lists `pairs` holds. At least a tile.
  int64_t EndOfRun(int64_t first, int64_t end) const;

  // Pixels of a plane of `picture`: whole rows of tiles, so some more than the picture's own.
  int64_t PlanePixels() const { return tile_rows_per_band * kTile * int64_t{view.size[0]}; }

  const std::shared_ptr<GpuDevice> device;

  // Of the last picture; render/gpu_layout.h has the shapes.
  GpuView view{};  // `counts` are set for every dispatch
  int64_t count = 0, tile_count = 0;
  int64_t visible = 0, total_pairs = 0;
  int64_t most_tiles = 0;  // no fewer than the tiles of all rectangles, of which some are in no list
  int runs = 0;
  std::vector<int64_t> tile_offsets;  // [T+1] first pair of each tile, of all runs
  GpuMemory seen, rects, radii, sizes, ranges, picture, kept;
  std::array<GpuMemory, 2> rows;              // rows[0] is `order`; of rows[1] and keys anything
  std::array<GpuMemory, 2> keys;              // u32 [N]
  std::array<GpuMemory, 2> pairs, pair_keys;  // u32 [pair_capacity]
  size_t listed = 0;                          // which of `pairs`
  int64_t listed_first = 0, listed_last = 0;  // tiles of that run
  int64_t pair_capacity = 0, run_pairs = 0;   // there is room for; at most of one run
  std::vector<int64_t> unusual_rows;          // ascending: those that were left to the CPU (render/unusual.wgsl)

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
  GpuMemory tables;       // u32, of sorts
  GpuMemory totals;       // u32 [16], of scans
  GpuMemory tile_counts;  // u32 [T]
  GpuMemory reports;      // vec4u, of pictures drawn without a look: render/tile_ranges.wgsl
  GpuMemory together;     // f32, such pictures, plane by plane
  uint32_t unusual_count = 0;
  bool counts_are_of_all = false;  // `places` holds the pairs of the whole picture, not scanned
  int64_t tile_rows_per_band = 0;  // of `picture`; all of them, or else it is read band by band
};

}  // namespace anchorsplat
