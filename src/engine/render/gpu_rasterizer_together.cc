#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <span>
#include <vector>

#include "render/gpu_rasterizer.h"
#include "render/project.h"
#include "render/wgsl.h"

// Pictures without host readback between tile counts and lists.
namespace anchorsplat {

namespace {

const GpuKernel kPlaceTiles = {"place_tiles", {wgsl::kWorkgroupSumsWgsl, wgsl::kTileRangesWgsl}};

struct TileRangesParameters {
  uint32_t tiles, pairs, slots, report_at;
};
using Report = std::array<uint32_t, 4>;  // visible, pairs, unusual, cut

constexpr int64_t kAny = std::numeric_limits<uint32_t>::max();

uint32_t BoundedWord(int64_t value) { return static_cast<uint32_t>(std::min(value, kAny)); }

int64_t PlanesOf(const RenderOptions& options) { return options.depth ? 5 : 4; }

}  // namespace

// Draw in a single run of tiles, after MakeView and MakeRoom.
void GpuRasterizer::RecordAhead(GpuCloud& cloud, int64_t most_pairs, int64_t most_slots, int64_t report) {
  const auto at_most = static_cast<uint64_t>(count);
  Project(cloud);
  SortAndCount();
  const TileRangesParameters room = {BoundedWord(tile_count), BoundedWord(most_pairs), BoundedWord(most_slots),
                                     BoundedWord(report)};
  device->Run(kPlaceTiles, AsParameters(room),
              {{1, tile_counts.get()}, {2, unusual.get()}, {3, sizes.get()}, {4, ranges.get()}, {5, reports.get()}}, 1);
  counts_are_of_all = false;
  listed_first = 0, listed_last = tile_count;
  runs = 1;
  ScanOnGpu(*device, {*sizes, kSizeVisible, *places, *totals, at_most});
  VisitTiles(0, tile_count, GpuBinStep::kListPairs, at_most);
  listed = SortOnGpu(*device, {*sizes,
                               kSizePairs,
                               {pair_keys[0].get(), pair_keys[1].get()},
                               {pairs[0].get(), pairs[1].get()},
                               *tables,
                               *totals,
                               static_cast<uint64_t>(most_pairs),
                               static_cast<int>(std::bit_width(static_cast<uint64_t>(tile_count - 1)))});
  Blend(0, tile_count, 0);
}

uint64_t GpuRasterizer::BytesTogether(const Pinhole& intrinsics, const RenderOptions& options) {
  const int64_t plane = int64_t{intrinsics.width} * TilesAcross(intrinsics.height) * kTile;
  return static_cast<uint64_t>(4 * PlanesOf(options) * plane);
}

Status GpuRasterizer::DrawTogether(GpuCloud& cloud, std::span<Picture> pictures, const RenderOptions& options,
                                   int64_t pairs_each) {
  uint64_t bytes = 0;
  for (const Picture& one : pictures) bytes += BytesTogether(one.camera.intrinsics, options);
  ANCHORSPLAT_RETURN_IF_ERROR(EnsureGpuMemory(*device, together, bytes, "pictures"));
  ANCHORSPLAT_RETURN_IF_ERROR(
      EnsureGpuMemory(*device, reports, sizeof(Report) * pictures.size(), "what is found out about pictures"));
  if (pair_capacity < pairs_each) {
    const Status room = RoomForPairs(pairs_each);
    if (!room.ok()) {
      DropSpare();
      return room.error();
    }
  }

  std::vector<Report> found(pictures.size());
  std::vector<GpuRead> reads = {{reports.get(), 0, std::as_writable_bytes(std::span(found))}};
  uint64_t at = 0;
  for (size_t k = 0; k < pictures.size(); ++k) {
    Picture& one = pictures[k];
    one.drawn = MakeView(cloud, one.camera, one.near, options);
    if (!one.drawn) continue;
    ANCHORSPLAT_RETURN_IF_ERROR(MakeRoom(/*whole_picture=*/true));
    ANCHORSPLAT_RETURN_IF_ERROR(
        EnsureGpuMemory(*device, tables, GpuSortTableBytes(static_cast<uint64_t>(pairs_each)), "tables of a sort"));
    RecordAhead(cloud, pairs_each, kAny, static_cast<int64_t>(k));
    const auto plane = static_cast<uint64_t>(4 * PlanePixels());
    device->Copy(*picture, 0, *together, at, static_cast<uint64_t>(PlanesOf(options)) * plane);
    const auto read = [&](uint64_t from, Image& to, int channel) {
      const std::span values(to.channel(channel), static_cast<size_t>(to.plane()));
      reads.push_back({together.get(), at + plane * from, std::as_writable_bytes(values)});
    };
    for (int c = 0; c < 3; ++c) read(static_cast<uint64_t>(c), one.output.color, c);
    read(3, one.output.alpha, 0);
    if (options.depth) read(4, one.output.depth, 0);
    at += static_cast<uint64_t>(PlanesOf(options)) * plane;
  }
  ANCHORSPLAT_RETURN_IF_ERROR(device->Read(reads));
  for (size_t k = 0; k < pictures.size(); ++k) {
    Picture& one = pictures[k];
    const auto [seen_by_it, pairs_of_it, unusual_of_it, cut] = found[k];
    one.visible = seen_by_it;
    one.total_pairs = pairs_of_it;
    one.drawn = one.drawn && unusual_of_it == 0 && one.total_pairs <= pairs_each;
  }
  return {};
}

}  // namespace anchorsplat
