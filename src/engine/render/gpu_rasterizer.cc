#include "render/gpu_rasterizer.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>
#include <numeric>

#include "core/text.h"
#include "render/project.h"
#include "render/wgsl.h"

namespace anchorsplat {

namespace {

const GpuKernel kMarkVisible = {"mark_visible", {wgsl::kViewWgsl, wgsl::kVisibleWgsl}};
const GpuKernel kListVisible = {"list_visible", {wgsl::kViewWgsl, wgsl::kVisibleWgsl}};
const GpuKernel kVisitTiles = {"visit_tiles", {wgsl::kViewWgsl, wgsl::kBinWgsl}};
const GpuKernel kBlend = {"blend", {wgsl::kViewWgsl, wgsl::kAlphaWgsl, wgsl::kBlendWgsl}};

struct VisibleParameters {
  uint32_t count, sums_at, unused[2];
};

struct BinParameters {
  uint32_t tiles_x, first_tile, last_tile, step, sums_at;
  float log2_min_alpha;
  uint32_t tiles, unused;
};

constexpr uint64_t kPixelBytes = 20;       // bytes per pixel of `picture`
constexpr int64_t kFewestPairs = 1 << 16;  // smaller runs are not worth the dispatches

template <typename T>
std::span<std::byte> Bytes(T* values, size_t count) {
  return std::as_writable_bytes(std::span(values, count));
}

}  // namespace

// All buffers except pairs.
Status GpuRasterizer::MakeRoom(bool whole_picture) {
  const auto n = static_cast<uint64_t>(count), tiles = static_cast<uint64_t>(tile_count);
  ANCHORSPLAT_RETURN_IF_ERROR(EnsureGpuMemory(*device, seen, n * sizeof(GpuSeen), "projected Gaussians"));
  ANCHORSPLAT_RETURN_IF_ERROR(EnsureGpuMemory(*device, rects, n * 8, "tiles of Gaussians"));
  ANCHORSPLAT_RETURN_IF_ERROR(EnsureGpuMemory(*device, radii, n * 8, "radii of Gaussians"));
  for (size_t k = 0; k < 2; ++k) {
    ANCHORSPLAT_RETURN_IF_ERROR(EnsureGpuMemory(*device, keys[k], n * 4, "depths of Gaussians"));
    ANCHORSPLAT_RETURN_IF_ERROR(EnsureGpuMemory(*device, rows[k], n * 4, "the order of Gaussians"));
  }
  ANCHORSPLAT_RETURN_IF_ERROR(EnsureGpuMemory(*device, unusual, n * 4 + 4, "unusual Gaussians"));
  ANCHORSPLAT_RETURN_IF_ERROR(EnsureGpuMemory(*device, places, GpuScanBytes(n), "the places of Gaussians"));
  ANCHORSPLAT_RETURN_IF_ERROR(EnsureGpuMemory(*device, tables, GpuSortTableBytes(n), "tables of a sort"));
  ANCHORSPLAT_RETURN_IF_ERROR(EnsureGpuMemory(*device, sizes, 64, "sizes"));
  ANCHORSPLAT_RETURN_IF_ERROR(EnsureGpuMemory(*device, totals, 64, "totals"));
  ANCHORSPLAT_RETURN_IF_ERROR(EnsureGpuMemory(*device, tile_counts, tiles * 4 + 4, "counts of tiles"));
  ANCHORSPLAT_RETURN_IF_ERROR(EnsureGpuMemory(*device, ranges, tiles * 4 + 4, "ranges of tiles"));

  // A picture that does not fit is drawn in bands, unless it must stay on the GPU.
  const uint64_t tile_row_pixels = uint64_t{view.size[0]} * kTile;
  const auto room_for_band = [&]() -> Status {
    const uint64_t pixels = static_cast<uint64_t>(tile_rows_per_band) * tile_row_pixels;
    ANCHORSPLAT_RETURN_IF_ERROR(EnsureGpuMemory(*device, kept, pixels * 8, "pixels"));
    return EnsureGpuMemory(*device, picture, pixels * kPixelBytes, "pixels");
  };
  tile_rows_per_band = view.size[3];
  Status room = room_for_band();
  while (!room.ok() && !whole_picture && tile_rows_per_band > 1) {
    tile_rows_per_band = (tile_rows_per_band + 1) / 2;
    room = room_for_band();
  }
  return room;
}

// Computes `order` and the pairs of every tile.
void GpuRasterizer::SortAndCount() {
  const auto n = static_cast<uint32_t>(count);
  device->Write(*sizes, 4 * kSizeGaussians, std::as_bytes(std::span(&n, 1)));
  const VisibleParameters parameters = {n, n, {}};
  device->Run(kMarkVisible, AsParameters(parameters), {{1, rects.get()}, {2, places.get()}}, GpuWorkgroups(n));
  ScanOnGpu(*device, {*sizes, kSizeGaussians, *places, *totals, n});
  device->Copy(*totals, 4 * kSizeGaussians, *sizes, 4 * kSizeVisible, 4);
  device->Run(kListVisible, AsParameters(parameters),
              {{1, rects.get()}, {3, places.get()}, {4, seen.get()}, {5, keys[0].get()}, {6, rows[0].get()}},
              GpuWorkgroups(n));
  SortOnGpu(*device, {*sizes,
                      kSizeVisible,
                      {keys[0].get(), keys[1].get()},
                      {rows[0].get(), rows[1].get()},
                      *tables,
                      *totals,
                      n,
                      32});  // eight passes end in rows[0]
  device->Clear(*tile_counts, 0, 4 * static_cast<uint64_t>(tile_count) + 4);
  VisitTiles(0, tile_count, GpuBinStep::kCountTiles, n);
  counts_are_of_all = true;
}

Status GpuRasterizer::ReadCounts() {
  const auto tiles = static_cast<size_t>(tile_count);
  std::vector<uint32_t> counts(tiles + 1);
  uint32_t total = 0;
  const std::array<GpuRead, 3> reads = {{{unusual.get(), 0, Bytes(&unusual_count, 1)},
                                         {sizes.get(), 4 * kSizeVisible, Bytes(&total, 1)},
                                         {tile_counts.get(), 0, Bytes(counts.data(), tiles + 1)}}};
  ANCHORSPLAT_RETURN_IF_ERROR(device->Read(reads));
  visible = total;
  tile_offsets.assign(tiles + 1, 0);
  std::inclusive_scan(counts.begin(), counts.end() - 1, tile_offsets.begin() + 1, std::plus<>(), int64_t{0});
  total_pairs = tile_offsets.back();
  most_tiles = total_pairs + int64_t{32} * counts.back();
  return {};
}

// Frees memory of other pictures to make room for this one.
void GpuRasterizer::DropSpare() {
  for (size_t k = 0; k < 2; ++k) pairs[k].reset(), pair_keys[k].reset();
  pair_capacity = 0;
  together.reset();
}

Status GpuRasterizer::RoomForPairs(int64_t wanted) {
  const uint64_t bytes = 4 * static_cast<uint64_t>(wanted);
  for (size_t k = 0; k < 2; ++k) {
    ANCHORSPLAT_RETURN_IF_ERROR(EnsureGpuMemory(*device, pairs[k], bytes, "pairs of tiles and Gaussians"));
    ANCHORSPLAT_RETURN_IF_ERROR(EnsureGpuMemory(*device, pair_keys[k], bytes, "pairs of tiles and Gaussians"));
  }
  pair_capacity = static_cast<int64_t>(
      std::min({pairs[0]->bytes(), pairs[1]->bytes(), pair_keys[0]->bytes(), pair_keys[1]->bytes()}) / 4);
  return {};
}

Status GpuRasterizer::MakeRoomForPairs(GpuCloud& cloud, int64_t max_pairs) {
  int64_t longest = 1;
  for (size_t t = 0; t + 1 < tile_offsets.size(); ++t)
    longest = std::max(longest, tile_offsets[t + 1] - tile_offsets[t]);
  const GpuAdapter& adapter = device->adapter();
  const auto largest = static_cast<int64_t>(
      std::min({adapter.max_binding, adapter.max_buffer, uint64_t{std::numeric_limits<uint32_t>::max()}}) / 4);
  const int64_t fewest = std::max(longest, std::min(total_pairs, kFewestPairs));
  int64_t wanted = std::max(longest, std::min({total_pairs, max_pairs, largest}));
  for (;;) {
    run_pairs = std::max(longest, std::min(max_pairs, std::max(wanted, pair_capacity)));
    Status room = RoomForPairs(wanted);
    if (room.ok()) {
      run_pairs = std::max(longest, std::min(max_pairs, pair_capacity));
      room =
          EnsureGpuMemory(*device, tables, GpuSortTableBytes(static_cast<uint64_t>(std::min(run_pairs, total_pairs))),
                          "tables of a sort");
    }
    if (room.ok()) return {};
    DropSpare();
    if (cloud.can_drop()) {
      cloud.Drop();  // already projected
    } else if (wanted > fewest) {
      wanted = std::max(fewest, wanted / 2);
    } else {
      return room;
    }
  }
}

void GpuRasterizer::VisitTiles(int64_t first, int64_t last, GpuBinStep step, uint64_t at_most) {
  const BinParameters parameters = {.tiles_x = view.size[2],
                                    .first_tile = static_cast<uint32_t>(first),
                                    .last_tile = static_cast<uint32_t>(last),
                                    .step = static_cast<uint32_t>(step),
                                    .sums_at = static_cast<uint32_t>(at_most),
                                    .log2_min_alpha = view.cuts[1],
                                    .tiles = static_cast<uint32_t>(tile_count),
                                    .unused = 0};
  // Counting writes no pairs.
  const bool lists = step == GpuBinStep::kListPairs;
  device->Run(kVisitTiles, AsParameters(parameters),
              {{1, sizes.get()},
               {2, rows[0].get()},
               {3, rects.get()},
               {4, seen.get()},
               {5, tile_counts.get()},
               {6, places.get()},
               {7, lists ? pair_keys[0].get() : keys[1].get()},
               {8, lists ? pairs[0].get() : rows[1].get()}},
              GpuWorkgroups(at_most));
}

int64_t GpuRasterizer::EndOfRun(int64_t first, int64_t end) const {
  const auto begin = tile_offsets.begin();
  const auto past =
      std::upper_bound(begin + first, begin + end + 1, tile_offsets[static_cast<size_t>(first)] + run_pairs);
  return std::clamp<int64_t>(past - begin - 1, first + 1, end);
}

void GpuRasterizer::ListRun(int64_t first, int64_t last) {
  listed_first = first, listed_last = last;
  const int64_t base = tile_offsets[static_cast<size_t>(first)];
  std::vector<uint32_t> starts(static_cast<size_t>(last - first) + 1);
  for (size_t t = 0; t < starts.size(); ++t) {
    starts[t] = static_cast<uint32_t>(tile_offsets[static_cast<size_t>(first) + t] - base);
  }
  const uint32_t total = starts.back();
  device->Write(*ranges, 0, std::as_bytes(std::span(starts)));
  device->Write(*sizes, 4 * kSizePairs, std::as_bytes(std::span(&total, 1)));
  listed = 0;
  if (total == 0) return;
  const auto at_most = static_cast<uint64_t>(visible);
  if (!counts_are_of_all || first != 0 || last != tile_count) VisitTiles(first, last, GpuBinStep::kCountPairs, at_most);
  counts_are_of_all = false;
  ScanOnGpu(*device, {*sizes, kSizeVisible, *places, *totals, at_most});
  VisitTiles(first, last, GpuBinStep::kListPairs, at_most);
  listed = SortOnGpu(*device, {*sizes,
                               kSizePairs,
                               {pair_keys[0].get(), pair_keys[1].get()},
                               {pairs[0].get(), pairs[1].get()},
                               *tables,
                               *totals,
                               total,
                               static_cast<int>(std::bit_width(static_cast<uint64_t>(last - first - 1)))});
}

// Blends tiles [first, last) of a band of tile rows.
void GpuRasterizer::Blend(int64_t first, int64_t last, int64_t band_row) {
  GpuView run = view;
  run.counts[0] = static_cast<uint32_t>(PlanePixels());
  run.counts[1] = static_cast<uint32_t>(first);
  run.counts[2] = static_cast<uint32_t>(last - first);
  run.counts[3] = static_cast<uint32_t>(band_row * kTile);
  device->Run(kBlend, AsParameters(run),
              {{1, seen.get()}, {2, ranges.get()}, {3, pairs[listed].get()}, {4, picture.get()}, {5, kept.get()}},
              static_cast<uint32_t>(last - first));
}

Status GpuRasterizer::ReadPicture(int64_t band_row, bool depth, RenderOutput& output) {
  const int64_t width = view.size[0], height = view.size[1], first = band_row * kTile;
  const auto pixels = static_cast<size_t>(width * (std::min(height, first + tile_rows_per_band * kTile) - first));
  const auto plane = static_cast<uint64_t>(PlanePixels());
  std::vector<GpuRead> reads;
  const auto read = [&](uint64_t from, Image& to, int channel) {
    reads.push_back(
        {picture.get(), 4 * plane * from, Bytes(to.pixels.data() + channel * to.plane() + first * width, pixels)});
  };
  for (int c = 0; c < 3; ++c) read(static_cast<uint64_t>(c), output.color, c);
  read(3, output.alpha, 0);
  if (depth) read(4, output.depth, 0);
  return device->Read(reads);
}

Result<bool> GpuRasterizer::Draw(GpuCloud& cloud, const Camera& camera, float near, const RenderOptions& options,
                                 RenderOutput* output) {
  if (!MakeView(cloud, camera, near, options)) return false;
  const bool whole = output == nullptr || options.gradient;
  Status room = MakeRoom(whole);
  if (!room.ok()) {
    DropSpare();
    room = MakeRoom(whole);
  }
  if (!room.ok() && cloud.can_stream()) {
    ANCHORSPLAT_RETURN_IF_ERROR(cloud.Stream(*device));
    room = MakeRoom(whole);
  }
  if (!room.ok()) return room.error();
  Project(cloud);
  SortAndCount();
  ANCHORSPLAT_RETURN_IF_ERROR(ReadCounts());
  if (unusual_count > 0) {
    ANCHORSPLAT_RETURN_IF_ERROR(ProjectOnCpu(cloud, camera, near, options));
    SortAndCount();
    ANCHORSPLAT_RETURN_IF_ERROR(ReadCounts());
  }
  ANCHORSPLAT_RETURN_IF_ERROR(MakeRoomForPairs(cloud, options.max_pairs));
  runs = 0;
  const int64_t tiles_x = view.size[2], tile_rows = view.size[3];
  for (int64_t row = 0; row < tile_rows; row += tile_rows_per_band) {
    const int64_t end = std::min(tile_rows, row + tile_rows_per_band) * tiles_x;
    for (int64_t first = row * tiles_x; first < end; ++runs) {
      const int64_t last = EndOfRun(first, end);
      ListRun(first, last);
      Blend(first, last, row);
      first = last;
    }
    if (output != nullptr) ANCHORSPLAT_RETURN_IF_ERROR(ReadPicture(row, options.depth, *output));
  }
  return true;
}

}  // namespace anchorsplat
