#include "formats/compressed_ply/compressed_ply_writer.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <mutex>
#include <optional>
#include <tuple>
#include <vector>

#include "core/activations.h"
#include "core/parallel.h"
#include "core/spherical_harmonics.h"
#include "core/statistics.h"
#include "core/text.h"
#include "formats/cloud_checks.h"
#include "formats/compressed_ply/compressed_ply_reader.h"
#include "formats/ply/ply_header.h"
#include "formats/ply/render_mode_tag.h"
#include "formats/quantize.h"
#include "formats/splat_order.h"
#include "formats/write_losses.h"
#include "io/atomic_file.h"

namespace anchorsplat {

namespace {

static_assert(std::endian::native == std::endian::little, "values are copied as they lie in memory");

constexpr int64_t kChunk = kCompressedPlyChunk;
constexpr size_t kChunkBytes = 18 * sizeof(float);
constexpr size_t kVertexBytes = 4 * sizeof(uint32_t);
constexpr int64_t kChunksPerTask = 32;
// Larger or smaller scales are practically infinite or zero, and one of them would use up the range of its chunk.
constexpr float kMaxPackedLogScale = 20;

int64_t Chunks(int64_t count) { return (count + kChunk - 1) / kChunk; }

std::string Header(const CloudView& cloud, int64_t count, int sh_degree) {
  std::string header = "ply\nformat binary_little_endian 1.0\n";
  header += PlyComments(cloud.comments, cloud.render_mode, cloud.origin);
  header += Cat("element chunk ", Chunks(count), "\n");
  for (const char* what : {"", "scale_"}) {
    for (const char* end : {"min_", "max_"}) {
      for (const char* axis : {"x", "y", "z"}) header += Cat("property float ", end, what, axis, "\n");
    }
  }
  for (const char* end : {"min_", "max_"}) {
    for (const char* channel : {"r", "g", "b"}) header += Cat("property float ", end, channel, "\n");
  }
  header += Cat("element vertex ", count, "\n");
  for (const char* what : {"position", "rotation", "scale", "color"})
    header += Cat("property uint packed_", what, "\n");
  if (sh_degree > 0) {
    header += Cat("element sh ", count, "\n");
    for (int k = 0; k < 3 * (ShCoefficients(sh_degree) - 1); ++k) header += Cat("property uchar f_rest_", k, "\n");
  }
  return header + "end_header\n";
}

// Three values per Gaussian of a chunk, with the range of the finite ones.
struct RangedValues {
  float values[kChunk][3];
  float min[3], max[3];

  void FindRange(int64_t count) {
    for (int k = 0; k < 3; ++k) {
      constexpr float kInfinity = std::numeric_limits<float>::infinity();
      float low = kInfinity, high = -kInfinity;
      for (int64_t i = 0; i < count; ++i) {
        const float value = values[i][k];
        if (!std::isfinite(value)) continue;
        low = std::min(low, value);
        high = std::max(high, value);
      }
      min[k] = low <= high ? low : 0;
      max[k] = low <= high ? high : 0;
    }
  }
  // In double, where the difference of any two floats is finite.
  uint32_t Quantize(int64_t i, int k, uint32_t steps) const {
    const double extent = double{max[k]} - double{min[k]};
    if (!(extent > 0)) return 0;
    return QuantizeUnit(static_cast<float>((double{values[i][k]} - double{min[k]}) / extent), steps);
  }
  uint32_t Pack111011(int64_t i) const {
    return Quantize(i, 0, 2047) << 21 | Quantize(i, 1, 1023) << 11 | Quantize(i, 2, 2047);
  }
};

uint32_t PackQuat(const float quat[4]) {
  const SmallestThree three = DropLargest(quat, 0);
  uint32_t packed = three.largest;
  for (const float component : three.rest) packed = packed << 10 | QuantizeUnit(component * kSqrtHalf + 0.5f, 1023);
  return packed;
}

void PackHarmonics(const float* sh, size_t rest, uint8_t* out) {
  uint8_t bytes[3 * ShCoefficients(kMaxShDegree)];
  for (size_t k = 0; k < rest; ++k) {
    // Truncated, as the reader places values in the middle of their step.
    const float scaled = (sh[k] / 8 + 0.5f) * 256;
    const float bounded = scaled > 0 ? (scaled < 255 ? scaled : 255.0f) : 0.0f;
    bytes[k] = static_cast<uint8_t>(static_cast<int32_t>(bounded));
  }
  for (size_t channel = 0; channel < 3; ++channel) {
    for (size_t k = 0; k < rest / 3; ++k) *out++ = bytes[3 * k + channel];
  }
}

// Prefetches a Gaussian: in Morton order rows are scattered, and waiting for each takes longer than the arithmetic.
void Prefetch(const CloudView& cloud, int64_t row) {
  const auto fetch = [](const float* values, int64_t count) {
    constexpr int64_t kLine = 64 / sizeof(float);
    for (int64_t k = 0; k < count; k += kLine) __builtin_prefetch(values + k);
    __builtin_prefetch(values + count - 1);  // if the row crosses a cache line
  };
  fetch(cloud.means.data() + 3 * row, 3);
  fetch(cloud.log_scales.data() + 3 * row, 3);
  fetch(cloud.quats.data() + 4 * row, 4);
  fetch(cloud.opacity_logits.data() + row, 1);
  fetch(cloud.sh.data() + row * cloud.sh_stride(), cloud.sh_stride());
}

// Destinations of one chunk in the three parts of the file.
struct PackedChunk {
  uint8_t* ranges;     // [18] floats
  uint8_t* vertices;   // [count][4] uints
  uint8_t* harmonics;  // [count][rest]
};

void PackChunk(const CloudView& cloud, const Buffer<uint32_t>& order, int64_t first, int64_t count,
               const PackedChunk& out) {
  RangedValues means, scales, colors;
  std::array<int64_t, kChunk> rows{};
  for (int64_t i = 0; i < count; ++i) {
    rows[static_cast<size_t>(i)] = order.empty() ? first + i : int64_t{order[static_cast<size_t>(first + i)]};
    Prefetch(cloud, rows[static_cast<size_t>(i)]);
  }
  for (int64_t i = 0; i < count; ++i) {
    const int64_t row = rows[static_cast<size_t>(i)];
    const float* dc = cloud.sh.data() + row * cloud.sh_stride();
    for (int k = 0; k < 3; ++k) {
      means.values[i][k] = cloud.means[static_cast<size_t>(3 * row + k)];
      const float log_scale = cloud.log_scales[static_cast<size_t>(3 * row + k)];
      scales.values[i][k] = std::clamp(log_scale, -kMaxPackedLogScale, kMaxPackedLogScale);  // NaN stays
      colors.values[i][k] = ColorFromDc(dc[k]);
    }
  }
  uint8_t* ranges = out.ranges;
  for (RangedValues* ranged : {&means, &scales, &colors}) {
    ranged->FindRange(count);
    std::memcpy(ranges, ranged->min, sizeof ranged->min);
    std::memcpy(ranges + sizeof ranged->min, ranged->max, sizeof ranged->max);
    ranges += 2 * sizeof ranged->min;
  }
  const auto rest = static_cast<size_t>(cloud.sh_stride()) - 3;
  for (int64_t i = 0; i < count; ++i) {
    const int64_t row = rows[static_cast<size_t>(i)];
    uint32_t color = 0;
    for (int k = 0; k < 3; ++k) color = color << 8 | colors.Quantize(i, k, 255);
    color = color << 8 | OpacityByte(cloud.opacity_logits[static_cast<size_t>(row)]);
    const uint32_t packed[4] = {means.Pack111011(i), PackQuat(cloud.quats.data() + 4 * row), scales.Pack111011(i),
                                color};
    std::memcpy(out.vertices + static_cast<size_t>(i) * kVertexBytes, packed, sizeof packed);
    if (rest > 0) {
      PackHarmonics(cloud.sh.data() + row * cloud.sh_stride() + 3, rest, out.harmonics + static_cast<size_t>(i) * rest);
    }
  }
}

}  // namespace

uint64_t PredictedCompressedPlySize(int64_t count, int sh_degree) {
  const auto rest = static_cast<uint64_t>(3 * (ShCoefficients(sh_degree) - 1));
  return Header({}, count, sh_degree).size() + static_cast<uint64_t>(Chunks(count)) * kChunkBytes +
         static_cast<uint64_t>(count) * (kVertexBytes + rest);
}

Status WriteCompressedPly(const std::filesystem::path& path, const CloudView& cloud, const CloudWriteOptions& options) {
  ANCHORSPLAT_RETURN_IF_ERROR(CheckWritable(path, cloud));
  const std::string header = Header(cloud, cloud.size(), cloud.sh_degree);
  if (header.size() > kMaxPlyHeader) {
    return Error{ErrorCode::kBadArgument,
                 Cat(path.string(), ": comments of ", HumanBytes(header.size()),
                     " do not fit a PLY header, which ends within ", HumanBytes(kMaxPlyHeader))};
  }
  const Buffer<uint32_t> order = WriteOrder(cloud, options.order, SplatOrder::kMorton);
  const int64_t chunks = Chunks(cloud.size());
  const auto rest = static_cast<size_t>(cloud.sh_stride()) - 3;
  const uint64_t ranges_begin = header.size();
  const uint64_t vertices_begin = ranges_begin + static_cast<uint64_t>(chunks) * kChunkBytes;
  const uint64_t harmonics_begin = vertices_begin + static_cast<uint64_t>(cloud.size()) * kVertexBytes;
  ANCHORSPLAT_ASSIGN_OR_RETURN(OutputFile file, OutputFile::Create(path, options.overwrite, options.memory));
  ANCHORSPLAT_RETURN_IF_ERROR(file.Reserve(harmonics_begin + static_cast<uint64_t>(cloud.size()) * rest));
  ANCHORSPLAT_RETURN_IF_ERROR(file.WriteAt(0, header.data(), header.size()));

  std::mutex mutex;
  Status failure;
  ParallelFor(0, chunks, kChunksPerTask, [&](int64_t first, int64_t last) {
    const int64_t begin = first * kChunk;
    const int64_t end = std::min(last * kChunk, cloud.size());
    const auto gaussians = static_cast<size_t>(end - begin);
    Buffer<uint8_t> ranges(static_cast<size_t>(last - first) * kChunkBytes);
    Buffer<uint8_t> vertices(gaussians * kVertexBytes);
    Buffer<uint8_t> harmonics(gaussians * rest);
    for (int64_t chunk = first; chunk < last; ++chunk) {
      const auto offset = static_cast<size_t>((chunk - first) * kChunk);
      PackChunk(cloud, order, chunk * kChunk, std::min(kChunk, end - chunk * kChunk),
                {ranges.data() + static_cast<size_t>(chunk - first) * kChunkBytes,
                 vertices.data() + offset * kVertexBytes, harmonics.data() + offset * rest});
    }
    const auto at = static_cast<uint64_t>(begin);
    for (const Status& status :
         {file.WriteAt(ranges_begin + static_cast<uint64_t>(first) * kChunkBytes, ranges.data(), ranges.size()),
          file.WriteAt(vertices_begin + at * kVertexBytes, vertices.data(), vertices.size()),
          file.WriteAt(harmonics_begin + at * rest, harmonics.data(), harmonics.size())}) {
      if (status.ok()) continue;
      const std::lock_guard lock(mutex);
      failure = status;
    }
  });
  ANCHORSPLAT_RETURN_IF_ERROR(failure);
  return file.Commit();
}

Strays CompressedPlyStrays(const CloudView& cloud) {
  Strays strays;
  const std::optional<Framing> framing = FramingWithFarOut(cloud);
  if (!framing) return strays;
  const Buffer<uint32_t> order = MortonOrder(cloud);
  struct Row {
    int64_t row;
    double away, weight, size;  // distance from the middle in world units; VisibleWeight; SizeOf
    bool far;
  };
  std::vector<Row> rows;
  for (int64_t first = 0; first < cloud.size(); first += kChunk) {
    rows.clear();
    bool any = false;
    for (int64_t i = first; i < std::min(first + kChunk, cloud.size()); ++i) {
      const int64_t row = order[static_cast<size_t>(i)];
      if (!HasUsableShape(cloud, row)) continue;
      const float* p = cloud.means.data() + 3 * row;
      const double away = std::hypot(p[0] - framing->target[0], p[1] - framing->target[1], p[2] - framing->target[2]);
      rows.push_back({row, away, 0, 0, IsFarOut(*framing, p)});
      any |= rows.back().far;
    }
    if (!any) continue;
    double all = 0;
    for (Row& row : rows) {
      row.weight = VisibleWeight(cloud, row.row, *framing);
      row.size = SizeOf(cloud, row.row);
      all += row.weight;
    }
    std::ranges::sort(rows,
                      [](const Row& a, const Row& b) { return std::tie(a.away, b.row) < std::tie(b.away, a.row); });
    // From the nearest outwards: the loss of those so far in their own box, and the weight of all others.
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    std::array<double, 3> low{kInfinity, kInfinity, kInfinity}, high{-kInfinity, -kInfinity, -kInfinity};
    double beyond = all, least = kInfinity, whole = 0;
    size_t best = rows.size();
    for (size_t k = 0; k < rows.size(); ++k) {
      for (size_t a = 0; a < 3; ++a) {
        const double x = cloud.means[static_cast<size_t>(3 * rows[k].row) + a];
        low[a] = std::min(low[a], x), high[a] = std::max(high[a], x);
      }
      beyond -= rows[k].weight;
      const bool can_end_here = k + 1 == rows.size() || rows[k + 1].far;
      if (!can_end_here) continue;
      const double step = std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]}) / 2047;
      double loss = std::max(beyond, 0.0);
      for (size_t j = 0; j <= k; ++j) loss += rows[j].weight * RoundingLoss(step, rows[j].size);
      if (loss <= least) {
        least = loss;
        best = k + 1;
      }
      whole = loss;
    }
    if (whole <= kVisibleLoss * all) continue;
    for (size_t k = best; k < rows.size(); ++k) {
      strays.rows.push_back(rows[k].row);
      strays.farthest = std::max(strays.farthest, rows[k].away);
    }
  }
  std::ranges::sort(strays.rows);
  return strays;
}

std::string CompressedPlyMeanLoss(const CloudView& cloud) {
  constexpr double kStray = 8;       // times the box of the middle 98 %: if all end there, no closer look is needed
  constexpr double kUsualChunk = 4;  // times its share of the volume; surfaces have larger chunks than solids
  constexpr double kLeastChunk = 0.5, kMostChunk = 2;  // relative to the box: steps of 1/4094 and 1/1023 of it
  const MiddleOfMeans middle = FindMiddleOfMeans(cloud);
  const std::optional<Bounds> bounds = ComputeBounds(cloud);
  double widest = 0;
  for (size_t a = 0; bounds && a < 3; ++a) widest = std::max(widest, double{bounds->max[a]} - double{bounds->min[a]});
  if (!(widest > kStray * double{middle.extent})) return {};

  const double share = std::cbrt(static_cast<double>(kChunk) / static_cast<double>(cloud.size()));
  const double usual = std::clamp(kUsualChunk * share, kLeastChunk, kMostChunk) * double{middle.extent};
  const Buffer<uint32_t> order = MortonOrder(cloud);
  int64_t coarse = 0;
  double largest = 0;
  for (int64_t first = 0; first < cloud.size(); first += kChunk) {
    const int64_t last = std::min(first + kChunk, cloud.size());
    double side = 0;
    for (int64_t a = 0; a < 3; ++a) {
      double low = std::numeric_limits<double>::infinity(), high = -low;
      for (int64_t i = first; i < last; ++i) {
        const double x = cloud.means[static_cast<size_t>(3 * int64_t{order[static_cast<size_t>(i)]} + a)];
        if (!std::isfinite(x)) continue;
        low = std::min(low, x);
        high = std::max(high, x);
      }
      side = std::max(side, high - low);  // −∞ if none is finite
    }
    if (side <= usual) continue;
    coarse += last - first;
    largest = std::max(largest, side);
  }
  if (coarse == 0) return {};
  return Cat("positions of ", WithThousands(coarse), " of ", WithThousands(cloud.size()),
             " Gaussians are rounded to steps of up to ", largest / 2047, ", as their chunks of ", kChunk,
             " span so much space; 98 % lie within a box of ", middle.extent, " (a PLY keeps them)");
}

}  // namespace anchorsplat
