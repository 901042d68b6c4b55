#include "formats/spz/spz_writer.h"

#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include "core/parallel.h"
#include "core/text.h"
#include "formats/axes.h"
#include "formats/cloud_checks.h"
#include "formats/splat_order.h"
#include "formats/spz/spz_extensions.h"
#include "formats/spz/spz_sections.h"
#include "formats/write_losses.h"
#include "io/atomic_file.h"

namespace anchorsplat {

namespace {

static_assert(std::endian::native == std::endian::little, "headers are written as they lie in memory");

// Level 4 takes about as long as packing; each further level doubles the time for 1 % of the size.
constexpr int kZstdLevel = 4;
constexpr int kDeflateLevel = 6;
constexpr size_t kBlockBytes = size_t{1} << 20;  // packed, and for version 3 deflated, per task
constexpr int64_t kBlocksAtOnce = 16;

constexpr int kUsualBits = 12;  // as in other programs
constexpr float kMaxFixed = (1 << 23) - 1;

struct MeansInSpz {
  float largest = 0;  // |coordinate|
  int fractional_bits = kUsualBits;
};

MeansInSpz LookAtMeans(const CloudView& cloud) {
  MeansInSpz out;
  float extent = 0;
  if (const std::optional<Bounds> bounds = ComputeBounds(cloud)) {
    for (size_t a = 0; a < 3; ++a) {
      extent = std::max(extent, bounds->max[a] - bounds->min[a]);
      out.largest = std::max({out.largest, std::fabs(bounds->min[a]), std::fabs(bounds->max[a])});
    }
  }
  const int fine = extent > 0 ? 16 - std::ilogb(extent) : kUsualBits;
  const int fits = out.largest > 0 ? 22 - std::ilogb(out.largest) : 24;
  out.fractional_bits = std::clamp(std::min(std::max(kUsualBits, fine), fits), 0, 24);
  return out;
}

struct Packer {
  const CloudView& cloud;
  SpzLayout layout;
  Buffer<uint32_t> order;
  std::string records = {};  // extension records
  AxisFlip flip = FlipBetween(kRdf, kRub);

  void Pack(SpzSection section, int64_t first, int64_t last, uint8_t* bytes) const {
    PackSpz(layout, section, first, last, cloud, order, flip, bytes);
  }
};

std::string HeaderOf(const Packer& packer) {
  std::string header(16, '\0');
  const uint32_t numbers[3] = {kSpzMagic, static_cast<uint32_t>(packer.layout.version),
                               static_cast<uint32_t>(packer.cloud.size())};
  std::memcpy(header.data(), numbers, sizeof numbers);
  header[12] = static_cast<char>(packer.layout.sh_degree);
  header[13] = static_cast<char>(packer.layout.fractional_bits);
  const int flags = (IsCompensated(packer.cloud.render_mode) ? kSpzAntialiased : 0) |
                    (packer.records.empty() ? 0 : kSpzHasExtensions);
  header[14] = static_cast<char>(flags);
  return header;
}

// ---- version 3: one gzip stream of blocks deflated in parallel

struct GzipBlock {
  SpzSection section;
  int64_t first, last;
};

struct Deflated {
  Buffer<uint8_t> bytes;
  uLong crc = 0;
  size_t raw = 0;
};

// A raw deflate stream that ends on a byte boundary, with a final block only if `final`: such streams can be
// concatenated.
void Deflate(const uint8_t* raw, size_t size, bool final, Deflated& out) {
  z_stream stream{};
  if (deflateInit2(&stream, kDeflateLevel, Z_DEFLATED, -MAX_WBITS, 9, Z_DEFAULT_STRATEGY) != Z_OK)
    throw std::bad_alloc();
  out.bytes.resize(deflateBound(&stream, static_cast<uLong>(size)) + 16);
  stream.next_in = const_cast<Bytef*>(raw);
  stream.avail_in = static_cast<uInt>(size);
  stream.next_out = out.bytes.data();
  stream.avail_out = static_cast<uInt>(out.bytes.size());
  deflate(&stream, final ? Z_FINISH : Z_SYNC_FLUSH);
  out.bytes.resize(stream.total_out);
  deflateEnd(&stream);
  out.crc = crc32(0, raw, static_cast<uInt>(size));
  out.raw = size;
}

Status WriteGzip(const Packer& packer, OutputFile& file) {
  const std::string header = HeaderOf(packer);
  std::vector<GzipBlock> blocks;
  for (const SpzSection section : kSpzSections) {
    const size_t record = packer.layout.record_size(section);
    if (record == 0) continue;
    const auto records = static_cast<int64_t>(kBlockBytes / record);
    for (int64_t first = 0; first < packer.cloud.size(); first += records) {
      blocks.push_back({section, first, std::min(first + records, packer.cloud.size())});
    }
  }
  Deflated first_block;
  Deflate(reinterpret_cast<const uint8_t*>(header.data()), header.size(), false, first_block);
  ANCHORSPLAT_RETURN_IF_ERROR(file.Write(std::string_view("\x1f\x8b\x08\0\0\0\0\0\0\xff", 10)));
  ANCHORSPLAT_RETURN_IF_ERROR(file.Write(first_block.bytes.data(), first_block.bytes.size()));
  uLong crc = first_block.crc;
  uint64_t raw = header.size();
  for (size_t begin = 0; begin < blocks.size(); begin += kBlocksAtOnce) {
    const size_t end = std::min(begin + size_t{kBlocksAtOnce}, blocks.size());
    std::array<Deflated, kBlocksAtOnce> deflated;
    ParallelFor(static_cast<int64_t>(begin), static_cast<int64_t>(end), 1, [&](int64_t from, int64_t to) {
      for (auto k = static_cast<size_t>(from); k < static_cast<size_t>(to); ++k) {
        const GzipBlock& block = blocks[k];
        Buffer<uint8_t> bytes(static_cast<size_t>(block.last - block.first) * packer.layout.record_size(block.section));
        packer.Pack(block.section, block.first, block.last, bytes.data());
        const bool last = k + 1 == blocks.size() && packer.records.empty();
        Deflate(bytes.data(), bytes.size(), last, deflated[k - begin]);
      }
    });
    for (size_t k = begin; k < end; ++k) {
      const Deflated& block = deflated[k - begin];
      ANCHORSPLAT_RETURN_IF_ERROR(file.Write(block.bytes.data(), block.bytes.size()));
      crc = crc32_combine(crc, block.crc, static_cast<z_off_t>(block.raw));
      raw += block.raw;
    }
  }
  if (!packer.records.empty()) {
    Deflated records;
    Deflate(reinterpret_cast<const uint8_t*>(packer.records.data()), packer.records.size(), true, records);
    ANCHORSPLAT_RETURN_IF_ERROR(file.Write(records.bytes.data(), records.bytes.size()));
    crc = crc32_combine(crc, records.crc, static_cast<z_off_t>(records.raw));
    raw += records.raw;
  }
  const uint32_t trailer[2] = {static_cast<uint32_t>(crc), static_cast<uint32_t>(raw)};
  return file.Write(trailer, sizeof trailer);
}

// ---- version 4: a zstd frame per section

struct PackedStreamSize {
  uint64_t compressed, raw;
};

Status WriteZstdStream(const Packer& packer, SpzSection section, OutputFile& file, PackedStreamSize& size) {
  const std::unique_ptr<ZSTD_CCtx, size_t (*)(ZSTD_CCtx*)> context(ZSTD_createCCtx(), ZSTD_freeCCtx);
  if (context == nullptr) throw std::bad_alloc();
  const size_t record = packer.layout.record_size(section);
  size.raw = static_cast<uint64_t>(packer.cloud.size()) * record;
  size.compressed = 0;
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, kZstdLevel);
  // Always uses the library's threads: its jobs, and so the bytes, are the same for any number of them. Only a library
  // without threads gives other bytes.
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_nbWorkers, std::clamp(ThreadCount(), 1, 16));
  ZSTD_CCtx_setPledgedSrcSize(context.get(), size.raw);

  const auto records = static_cast<int64_t>(4 * kBlockBytes / record);
  Buffer<uint8_t> raw(static_cast<size_t>(std::min(records, packer.cloud.size())) * record);
  Buffer<uint8_t> compressed(ZSTD_CStreamOutSize());
  for (int64_t begin = 0; begin < packer.cloud.size(); begin += records) {
    const int64_t end = std::min(begin + records, packer.cloud.size());
    ParallelFor(begin, end, 1 << 13, [&](int64_t first, int64_t last) {
      packer.Pack(section, first, last, raw.data() + static_cast<size_t>(first - begin) * record);
    });
    ZSTD_inBuffer from{raw.data(), static_cast<size_t>(end - begin) * record, 0};
    const bool last_block = end == packer.cloud.size();
    for (;;) {
      ZSTD_outBuffer to{compressed.data(), compressed.size(), 0};
      const size_t left = ZSTD_compressStream2(context.get(), &to, &from, last_block ? ZSTD_e_end : ZSTD_e_continue);
      if (ZSTD_isError(left) != 0) {
        return Error{ErrorCode::kIo, Cat("cannot compress (zstd: ", ZSTD_getErrorName(left), ")")};
      }
      ANCHORSPLAT_RETURN_IF_ERROR(file.Write(to.dst, to.pos));
      size.compressed += to.pos;
      if (last_block ? left == 0 : from.pos == from.size) break;
    }
  }
  return {};
}

Status WriteStreams(const Packer& packer, OutputFile& file) {
  std::array<PackedStreamSize, 6> sizes{};
  const size_t streams = packer.layout.sh_degree > 0 ? 6 : 5;
  std::string header = HeaderOf(packer);
  header[15] = static_cast<char>(streams);
  header.append(16, '\0');
  const auto table = static_cast<uint32_t>(header.size() + packer.records.size());
  std::memcpy(header.data() + 16, &table, sizeof table);
  header += packer.records;
  ANCHORSPLAT_RETURN_IF_ERROR(file.Write(header));
  ANCHORSPLAT_RETURN_IF_ERROR(file.Write(sizes.data(), streams * sizeof(PackedStreamSize)));
  for (size_t k = 0; k < streams; ++k) {
    ANCHORSPLAT_RETURN_IF_ERROR(WriteZstdStream(packer, kSpzSections[k], file, sizes[k]));
  }
  return file.WriteAt(header.size(), sizes.data(), streams * sizeof(PackedStreamSize));
}

}  // namespace

Status WriteSpz(const std::filesystem::path& path, const CloudView& cloud, const CloudWriteOptions& options) {
  ANCHORSPLAT_RETURN_IF_ERROR(CheckWritable(path, cloud));
  if (options.spz_version != 3 && options.spz_version != 4) {
    return Error{ErrorCode::kBadArgument,
                 Cat(path.string(), ": SPZ version ", options.spz_version, " is not written, expected 3 or 4")};
  }
  if (cloud.size() > std::numeric_limits<int32_t>::max()) {
    return Error{ErrorCode::kBadArgument,
                 Cat(path.string(), ": ", WithThousands(cloud.size()), " Gaussians are too many for an SPZ file")};
  }
  const Packer packer{.cloud = cloud,
                      .layout = {options.spz_version, cloud.sh_degree, LookAtMeans(cloud).fractional_bits},
                      .order = WriteOrder(cloud, options.order, SplatOrder::kKeep),
                      .records = BytesOfSpzExtensions(SpzExtensionsOf(cloud.comments))};
  ANCHORSPLAT_ASSIGN_OR_RETURN(OutputFile file, OutputFile::Create(path, options.overwrite, options.memory));
  ANCHORSPLAT_RETURN_IF_ERROR(options.spz_version == 3 ? WriteGzip(packer, file) : WriteStreams(packer, file));
  return file.Commit();
}

uint64_t EstimatedSpzSize(int64_t count, int sh_degree) {
  constexpr std::array<double, 4> kBytes = {16.6, 18.8, 21.0, 23.2};
  return 128 + static_cast<uint64_t>(kBytes[static_cast<size_t>(sh_degree)] * static_cast<double>(count));
}

Strays SpzStrays(const CloudView& cloud) {
  const auto step = [](double reach) {
    if (reach > double{kMaxFixed}) return std::numeric_limits<double>::infinity();  // no number of bits suffices
    return std::ldexp(1.0, -std::clamp(reach > 0 ? 22 - std::ilogb(reach) : kUsualBits, 0, kUsualBits));
  };
  return ChooseStrays(cloud, step, [](double) { return 1.0; });
}

std::string SpzMeanLoss(const CloudView& cloud) {
  const MeansInSpz means = LookAtMeans(cloud);
  if (means.largest > kMaxFixed) {
    return Cat("coordinates reach ", means.largest, ", beyond the SPZ limit of ", kMaxFixed,
               ": clamped, and all others rounded to whole numbers (a PLY keeps them)");
  }
  const double step = std::ldexp(1.0, -means.fractional_bits);
  if (means.fractional_bits >= kUsualBits) return {};
  const MiddleOfMeans middle = FindMiddleOfMeans(cloud);
  constexpr double kFine = 1 << 14;  // steps across a scene, too fine to see
  if (step * kFine <= double{middle.extent}) return {};
  return Cat("positions are rounded to 1/", 1 << means.fractional_bits, " instead of 1/4096, as coordinates reach ",
             means.largest, " while 98 % of the Gaussians lie within a box of ", middle.extent,
             " (a PLY or a compressed PLY keeps them better)");
}

}  // namespace anchorsplat
