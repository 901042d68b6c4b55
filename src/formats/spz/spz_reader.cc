#include "formats/spz/spz_reader.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <memory>

#include "core/log.h"
#include "core/parallel.h"
#include "core/text.h"
#include "formats/axes.h"
#include "formats/cloud_checks.h"
#include "formats/spz/spz_sections.h"
#include "io/compression_ratio.h"
#include "io/inflating_reader.h"

namespace anchorsplat {

namespace {

static_assert(std::endian::native == std::endian::little, "headers are copied as they lie in the file");

struct SpzHeader {
  uint32_t magic, version, count;
  uint8_t sh_degree, fractional_bits, flags, streams;
};
static_assert(sizeof(SpzHeader) == 16);

// Version 4: follows the header; streams begin after the table.
struct TablePlace {
  uint32_t offset;
  uint32_t reserved[3];
};
struct StreamSize {
  uint64_t compressed, raw;
};

constexpr int64_t kSpzBlock = 1 << 15;  // Gaussians that are unpacked while they are in the cache
constexpr int64_t kSpzGrain = 1 << 12;

std::string At(const InputFile& file, uint64_t byte) {
  return Cat(file.name(), ": byte ", WithThousands(static_cast<int64_t>(byte)));
}

// The layout that the header speaks of, and a cloud that has room for it.
Result<SpzLayout> CheckHeader(const InputFile& file, const SpzHeader& header, const ReadLimits& limits) {
  const auto bad = [&file](uint64_t byte, const std::string& what) {
    return Error{ErrorCode::kBadFile, Cat(At(file, byte), " of the SPZ header: ", what)};
  };
  if (header.magic != kSpzMagic) return bad(0, "does not begin with \"NGSP\": no SPZ file");
  if (header.version < 1 || header.version > 4) return bad(4, Cat("version ", header.version, ", expected 1 to 4"));
  ANCHORSPLAT_RETURN_IF_ERROR(CheckCount(At(file, 8), header.count, limits));
  if (header.sh_degree > kMaxSpzShDegree) return bad(12, Cat("SH degree ", int{header.sh_degree}, ", expected 0 to 4"));
  if (header.fractional_bits > 24)
    return bad(13, Cat(int{header.fractional_bits}, " fractional bits, expected 0 to 24"));
  SpzLayout layout;
  layout.version = static_cast<int>(header.version);
  layout.sh_degree = header.sh_degree;
  layout.fractional_bits = header.fractional_bits;
  ANCHORSPLAT_RETURN_IF_ERROR(CheckRatio(file.name(), file.size(), header.count * uint64_t{layout.record_size()}));
  return layout;
}

GaussianCloud MakeCloud(const InputFile& file, const SpzHeader& header) {
  if (header.sh_degree > kMaxShDegree) LogWarning(Cat(file.name(), ": SH degree 4 is read as 3"));
  GaussianCloud cloud;
  cloud.Resize(header.count, std::min<int>(header.sh_degree, kMaxShDegree));
  if ((header.flags & kSpzAntialiased) != 0) cloud.render_mode = RenderMode::kAntialiased;
  return cloud;
}

Status ReadSection(const SpzLayout& layout, SpzSection section, InflatingReader& reader, GaussianCloud& cloud) {
  const size_t record = layout.record_size(section);
  const AxisFlip flip = FlipBetween(kRub, kRdf);
  Buffer<uint8_t> bytes(static_cast<size_t>(std::min(kSpzBlock, cloud.size())) * record);
  for (int64_t begin = 0; begin < cloud.size(); begin += kSpzBlock) {
    const int64_t end = std::min(begin + kSpzBlock, cloud.size());
    ANCHORSPLAT_RETURN_IF_ERROR(reader.Read(bytes.data(), static_cast<size_t>(end - begin) * record));
    ParallelFor(begin, end, kSpzGrain, [&](int64_t first, int64_t last) {
      UnpackSpz(layout, section, first, last, bytes.data() + static_cast<size_t>(first - begin) * record, flip, cloud);
    });
  }
  return {};
}

Result<GaussianCloud> ReadGzipped(const InputFile& file, const ReadLimits& limits) {
  const std::unique_ptr<InflatingReader> reader = OpenGzip(file, 0);
  SpzHeader header;
  ANCHORSPLAT_RETURN_IF_ERROR(reader->Read(&header, sizeof header));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const SpzLayout layout, CheckHeader(file, header, limits));
  if (layout.version > 3) return Error{ErrorCode::kBadFile, Cat(At(file, 0), ": version 4 in a gzip stream")};
  GaussianCloud cloud = MakeCloud(file, header);
  for (const SpzSection section : kSpzSections) {
    if (layout.record_size(section) == 0) continue;
    ANCHORSPLAT_RETURN_IF_ERROR(ReadSection(layout, section, *reader, cloud));
  }
  // A stream that is longer than its header says is another splat than the header's.
  ANCHORSPLAT_RETURN_IF_ERROR(reader->ExpectEnd());
  return cloud;
}

Result<GaussianCloud> ReadStreams(const InputFile& file, const ReadLimits& limits) {
  SpzHeader header;
  TablePlace place;
  ANCHORSPLAT_RETURN_IF_ERROR(file.ReadAt(0, &header, sizeof header));
  ANCHORSPLAT_RETURN_IF_ERROR(file.ReadAt(sizeof header, &place, sizeof place));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const SpzLayout layout, CheckHeader(file, header, limits));
  if (layout.version < 4) {
    return Error{ErrorCode::kBadFile, Cat(At(file, 4), ": version ", layout.version, " outside of a gzip stream")};
  }
  const size_t streams = header.sh_degree > 0 ? 6 : 5;
  if (header.streams != streams || place.offset < sizeof header + sizeof place) {
    return Error{ErrorCode::kBadFile,
                 Cat(At(file, 15), ": has ", int{header.streams}, " streams with their table at byte ", place.offset,
                     ", expected ", streams, " and a table from byte 32 on")};
  }
  std::array<StreamSize, 6> sizes{};
  ANCHORSPLAT_RETURN_IF_ERROR(file.ReadAt(place.offset, sizes.data(), streams * sizeof(StreamSize)));
  std::array<uint64_t, 7> begins{};
  begins[0] = place.offset + streams * sizeof(StreamSize);
  for (size_t k = 0; k < streams; ++k) {
    const uint64_t expected = header.count * uint64_t{layout.record_size(kSpzSections[k])};
    if (sizes[k].compressed > file.size() - begins[k] || sizes[k].raw != expected) {
      return Error{ErrorCode::kBadFile, Cat(At(file, place.offset + k * sizeof(StreamSize)), ": stream ", k, " has ",
                                            sizes[k].compressed, " bytes for ", sizes[k].raw, ", expected ", expected,
                                            " from at most ", file.size() - begins[k])};
    }
    begins[k + 1] = begins[k] + sizes[k].compressed;
  }
  GaussianCloud cloud = MakeCloud(file, header);
  std::array<Status, 6> statuses;
  ParallelFor(0, static_cast<int64_t>(streams), 1, [&](int64_t first, int64_t last) {
    for (auto k = static_cast<size_t>(first); k < static_cast<size_t>(last); ++k) {
      // The last stream is by far the longest: it goes first.
      const size_t stream = streams - 1 - k;
      const std::unique_ptr<InflatingReader> reader = OpenZstd(file, begins[stream], begins[stream + 1]);
      statuses[stream] = ReadSection(layout, kSpzSections[stream], *reader, cloud);
      if (statuses[stream].ok()) statuses[stream] = reader->ExpectEnd();
    }
  });
  for (const Status& status : statuses) ANCHORSPLAT_RETURN_IF_ERROR(status);
  return cloud;
}

bool IsGzip(const std::string& head) { return head == "\x1f\x8b"; }

Result<SpzHeader> ReadHeader(const InputFile& file) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string head, file.Head(2));
  SpzHeader header;
  if (IsGzip(head)) {
    ANCHORSPLAT_RETURN_IF_ERROR(OpenGzip(file, 0)->Read(&header, sizeof header));
  } else {
    ANCHORSPLAT_RETURN_IF_ERROR(file.ReadAt(0, &header, sizeof header));
  }
  return header;
}

}  // namespace

Result<CloudExtent> ExtentOfSpz(const InputFile& file) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const SpzHeader header, ReadHeader(file));
  ANCHORSPLAT_RETURN_IF_ERROR([&]() -> Status {
    const auto layout = CheckHeader(file, header, {});
    return layout.ok() ? Status() : Status(layout.error());
  }());
  return CloudExtent{header.count, std::min<int>(header.sh_degree, kMaxShDegree)};
}

Result<FormatFacts> DescribeSpz(const InputFile& file) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const SpzHeader header, ReadHeader(file));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const SpzLayout layout, CheckHeader(file, header, {}));
  FormatFacts facts;
  facts.Add("version", layout.version, layout.version < 4 ? ", one gzip stream" : ", a zstd stream per attribute");
  if (layout.version == 1) {
    facts.Add("positions", "half floats");
  } else {
    facts.Add("positions", layout.fractional_bits, " fractional bits: steps of 1/",
              uint32_t{1} << layout.fractional_bits);
  }
  facts.Add("antialiased", (header.flags & kSpzAntialiased) != 0 ? "yes" : "no, or not said");
  if (layout.sh_degree > kMaxShDegree) facts.Add("harmonics", "degree ", layout.sh_degree, ", read as ", kMaxShDegree);
  return facts;
}

Result<GaussianCloud> ReadSpz(const InputFile& file, const ReadLimits& limits) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string head, file.Head(2));
  return IsGzip(head) ? ReadGzipped(file, limits) : ReadStreams(file, limits);
}

}  // namespace anchorsplat
