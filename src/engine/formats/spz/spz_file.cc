#include "formats/spz/spz_file.h"

#include <algorithm>
#include <bit>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/log.h"
#include "core/run_context.h"
#include "core/text.h"
#include "formats/cloud_checks.h"
#include "formats/spz/spz_reader.h"
#include "io/compression_ratio.h"

namespace anchorsplat {

namespace {

static_assert(std::endian::native == std::endian::little, "headers are copied as they lie in the file");

struct SpzHeader {
  uint32_t magic, version, count;
  uint8_t sh_degree, fractional_bits, flags, streams;  // `streams` is reserved before version 4
};
static_assert(sizeof(SpzHeader) == 16);

// Version 4: after the header; streams begin after the table.
struct TablePlace {
  uint32_t offset;
  uint32_t reserved[3];
};
struct StreamSize {
  uint64_t compressed, raw;
};

std::string At(const InputFile& file, uint64_t byte) {
  return Cat(file.name(), ": byte ", WithThousands(static_cast<int64_t>(byte)));
}

// Layout from the header.
Result<SpzLayout> CheckHeader(const InputFile& file, const SpzHeader& header, const ReadLimits& limits) {
  const auto bad = [&file](uint64_t byte, const std::string& what) {
    return Error{ErrorCode::kBadFile, Cat(At(file, byte), " of the SPZ header: ", what)};
  };
  if (header.magic != kSpzMagic) return bad(0, "does not begin with \"NGSP\": not an SPZ file");
  if (header.version < 1 || header.version > 4) return bad(4, Cat("version ", header.version, ", expected 1 to 4"));
  ANCHORSPLAT_RETURN_IF_ERROR(CheckCount(At(file, 8), header.count, limits));
  if (header.sh_degree > kMaxSpzShDegree) return bad(12, Cat("SH degree ", int{header.sh_degree}, ", expected 0 to 4"));
  if (header.fractional_bits > 24)
    return bad(13, Cat(int{header.fractional_bits}, " fractional bits, expected 0 to 24"));
  SpzLayout layout;
  layout.version = static_cast<int>(header.version);
  layout.sh_degree = header.sh_degree;
  layout.fractional_bits = header.fractional_bits;
  ANCHORSPLAT_RETURN_IF_ERROR(
      CheckCompressionRatio(file.name(), file.size(), header.count * uint64_t{layout.record_size()}));
  return layout;
}

SpzFile FileOf(const SpzHeader& header, const SpzLayout& layout) {
  SpzFile spz;
  spz.layout = layout;
  spz.count = header.count;
  spz.antialiased = (header.flags & kSpzAntialiased) != 0;
  spz.unknown_flags = static_cast<uint8_t>(header.flags & ~(kSpzAntialiased | kSpzHasExtensions));
  return spz;
}

// Skips the sections of a gzip stream.
Status PassOverSections(const SpzFile& spz, CopyableReader& reader) {
  std::vector<uint8_t> scratch(size_t{64} << 10);
  for (uint64_t left = static_cast<uint64_t>(spz.count) * spz.layout.record_size(); left > 0;) {
    LeaveIfAbandoned();
    const auto size = static_cast<size_t>(std::min<uint64_t>(scratch.size(), left));
    ANCHORSPLAT_RETURN_IF_ERROR(reader.Read(scratch.data(), size));
    left -= size;
  }
  return {};
}

Status TakeExtensions(const InputFile& file, uint64_t begin, const std::string& bytes, SpzFile& spz) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(spz.extensions, ParseSpzExtensions(file.name(), begin, bytes));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::optional<Axes> axes, AxesOfSpz(file.name(), spz.extensions));
  spz.axes = axes.value_or(kRub);
  return {};
}

// Versions 1 to 3, in gzip, raw, or recompressed by another program.
Result<SpzFile> OpenOneStream(const InputFile& file, std::unique_ptr<CopyableReader> reader, const ReadLimits& limits) {
  SpzHeader header;
  ANCHORSPLAT_RETURN_IF_ERROR(reader->Read(&header, sizeof header));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const SpzLayout layout, CheckHeader(file, header, limits));
  if (layout.version > 3) return Error{ErrorCode::kBadFile, Cat(At(file, 0), ": version 4 in a gzip stream")};
  SpzFile spz = FileOf(header, layout);
  spz.reserved_used = header.streams != 0;
  if ((header.flags & kSpzHasExtensions) != 0) {
    // They define the meaning of the preceding numbers.
    const std::unique_ptr<CopyableReader> behind = reader->Copy();
    ANCHORSPLAT_RETURN_IF_ERROR(PassOverSections(spz, *behind));
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string bytes, ReadSpzExtensionBytes(file.name(), *behind));
    ANCHORSPLAT_RETURN_IF_ERROR(behind->ExpectEnd());
    const uint64_t begin = sizeof header + static_cast<uint64_t>(spz.count) * spz.layout.record_size();
    ANCHORSPLAT_RETURN_IF_ERROR(TakeExtensions(file, begin, bytes, spz));
    spz.end_read = true;
  }
  spz.stream = std::move(reader);
  return spz;
}

Result<SpzFile> OpenStreams(const InputFile& file, const ReadLimits& limits) {
  SpzHeader header;
  TablePlace place;
  ANCHORSPLAT_RETURN_IF_ERROR(file.ReadAt(0, &header, sizeof header));
  ANCHORSPLAT_RETURN_IF_ERROR(file.ReadAt(sizeof header, &place, sizeof place));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const SpzLayout layout, CheckHeader(file, header, limits));
  SpzFile spz = FileOf(header, layout);
  const size_t streams = header.sh_degree > 0 ? 6 : 5;
  if (header.streams != streams || place.offset < sizeof header + sizeof place) {
    return Error{ErrorCode::kBadFile,
                 Cat(At(file, 15), ": has ", int{header.streams}, " streams with their table at byte ", place.offset,
                     ", expected ", streams, " and a table from byte 32 on")};
  }
  spz.reserved_used = std::ranges::any_of(place.reserved, [](uint32_t word) { return word != 0; });
  constexpr uint64_t kHead = sizeof header + sizeof place;
  if (place.offset > file.size() || place.offset - kHead > kMaxSpzExtensionBytes) {
    return Error{ErrorCode::kBadFile,
                 Cat(At(file, 16), ": has its table at byte ", place.offset, " of ", file.size(), ", after ",
                     place.offset - kHead, " bytes of extension records (at most ", kMaxSpzExtensionBytes, ")")};
  }
  std::string records(static_cast<size_t>(place.offset - kHead), '\0');
  ANCHORSPLAT_RETURN_IF_ERROR(file.ReadAt(kHead, records.data(), records.size()));
  const Status taken = TakeExtensions(file, kHead, records, spz);
  if (!taken.ok() && ((header.flags & kSpzHasExtensions) != 0 || !spz.extensions.empty())) return taken.error();
  spz.skipped_bytes = taken.ok() ? 0 : records.size();
  std::array<StreamSize, 6> sizes{};
  ANCHORSPLAT_RETURN_IF_ERROR(file.ReadAt(place.offset, sizes.data(), streams * sizeof(StreamSize)));
  std::array<uint64_t, 7>& begins = spz.begins;
  begins[0] = place.offset + streams * sizeof(StreamSize);
  for (size_t k = 0; k < streams; ++k) {
    const uint64_t expected = header.count * uint64_t{spz.layout.record_size(kSpzSections[k])};
    if (sizes[k].compressed > file.size() - begins[k] || sizes[k].raw != expected) {
      return Error{ErrorCode::kBadFile, Cat(At(file, place.offset + k * sizeof(StreamSize)), ": stream ", k, " has ",
                                            sizes[k].compressed, " bytes for ", sizes[k].raw, ", expected ", expected,
                                            " from at most ", file.size() - begins[k])};
    }
    begins[k + 1] = begins[k] + sizes[k].compressed;
  }
  return spz;
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

int SpzFile::sh_degree() const { return std::min(layout.sh_degree, kMaxShDegree); }
size_t SpzFile::sections() const { return layout.sh_degree > 0 ? 6 : 5; }

Result<SpzFile> OpenSpz(const InputFile& file, const ReadLimits& limits) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string head, file.Head(2));
  if (IsGzip(head)) return OpenOneStream(file, OpenGzip(file, 0), limits);
  std::array<uint32_t, 2> mark{};  // and the version
  ANCHORSPLAT_RETURN_IF_ERROR(file.ReadAt(0, mark.data(), std::min<size_t>(sizeof mark, file.size())));
  if (mark[0] != kSpzMagic) {
    return Error{ErrorCode::kBadFile, Cat(At(file, 0), ": does not begin with \"NGSP\": not an SPZ file")};
  }
  return mark[1] < 4 ? OpenOneStream(file, OpenPlain(file, 0), limits) : OpenStreams(file, limits);
}

SpzTurn TurnOfSpz(const SpzFile& spz) {
  const AxisTurn turn = TurnBetween(spz.axes, kRdf);
  if (turn.only_signs()) return {FlipBetween(spz.axes, kRdf), {}};
  return {FlipBetween(kRdf, kRdf), turn};
}

void WarnOfSpz(const InputFile& file, const SpzFile& spz) {
  if (spz.layout.sh_degree > kMaxShDegree) LogWarning(Cat(file.name(), ": SH degree 4 is read as 3"));
  if (spz.unknown_flags != 0) {
    LogWarning(
        Cat(file.name(), ": byte 14 of the SPZ header: sets unknown flags (", int{spz.unknown_flags}, "): ignored"));
  }
  if (spz.reserved_used) {
    LogWarning(Cat(file.name(), ": reserved bytes of the SPZ header are not zero: ignored"));
  }
  if (spz.skipped_bytes > 0) {
    LogWarning(Cat(file.name(), ": byte 32: skipped ", WithThousands(static_cast<int64_t>(spz.skipped_bytes)),
                   " bytes after the SPZ header that are not extension records"));
  }
  WarnOfSpzExtensions(file.name(), spz.extensions, spz.axes);
}

Result<CloudExtent> ExtentOfSpz(const InputFile& file) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const SpzHeader header, ReadHeader(file));
  ANCHORSPLAT_RETURN_IF_ERROR([&]() -> Status {
    const auto layout = CheckHeader(file, header, {});
    return layout.ok() ? Status() : Status(layout.error());
  }());
  return CloudExtent{header.count, std::min<int>(header.sh_degree, kMaxShDegree)};
}

Result<FormatFacts> DescribeSpz(const InputFile& file) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string head, file.Head(2));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const SpzFile spz, OpenSpz(file, {}));
  const SpzLayout& layout = spz.layout;
  FormatFacts facts;
  facts.Add("version", layout.version,
            layout.version > 3 ? ", a zstd stream per attribute"
            : IsGzip(head)     ? ", one gzip stream"
                               : ", uncompressed");
  if (layout.version == 1) {
    facts.Add("positions", "half floats");
  } else {
    facts.Add("positions", layout.fractional_bits, " fractional bits: steps of 1/",
              uint32_t{1} << layout.fractional_bits);
  }
  facts.Add("antialiased", spz.antialiased ? "yes" : "no, or not stated");
  facts.Add("axes", NameOfAxes(spz.axes));
  if (layout.sh_degree > kMaxShDegree) facts.Add("harmonics", "degree ", layout.sh_degree, ", read as ", kMaxShDegree);
  DescribeSpzExtensions(spz.extensions, facts);
  return facts;
}

Result<Axes> DeclaredAxesOfSpz(const InputFile& file) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const SpzFile spz, OpenSpz(file, {}));
  return spz.axes;
}

}  // namespace anchorsplat
