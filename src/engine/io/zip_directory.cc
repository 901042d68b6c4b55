#include "io/zip_directory.h"

#include <algorithm>
#include <cstdint>
#include <unordered_set>

#include "core/text.h"
#include "io/little_endian.h"

namespace anchorsplat {

namespace {

// Record layouts: PKWARE APPNOTE 6.3.10, sections 4.3.7 (local header), 4.3.12 (central directory), 4.3.14 to 4.3.16.
constexpr uint32_t kLocalMagic = 0x04034b50;
constexpr uint32_t kCentralMagic = 0x02014b50;
constexpr uint32_t kEndMagic = 0x06054b50;
constexpr uint32_t kEnd64Magic = 0x06064b50;
constexpr uint32_t kLocator64Magic = 0x07064b50;
constexpr uint64_t kLocalSize = 30;
constexpr uint64_t kCentralSize = 46;
constexpr uint64_t kEndSize = 22;
constexpr uint64_t kEnd64Size = 56;
constexpr uint64_t kLocator64Size = 20;
constexpr uint32_t kIn64Field = 0xffffffff;  // "look in the zip64 extra field"

struct Directory {
  uint64_t offset = 0;
  uint64_t size = 0;
  uint64_t entries = 0;
};

// Location of an entry: local header, then data.
struct Extent {
  uint64_t begin;
  uint64_t end;
  std::string_view name;
};

class DirectoryReader {
 public:
  DirectoryReader(std::span<const std::byte> archive, const std::string& file) : archive_(archive), file_(file) {}

  Result<std::vector<ZipEntry>> Read() {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Directory directory, FindDirectory());
    std::vector<ZipEntry> entries;
    std::vector<Extent> extents;
    std::unordered_set<std::string_view> names;
    uint64_t at = directory.offset;
    const uint64_t end = directory.offset + directory.size;
    for (uint64_t i = 0; i < directory.entries; ++i) {
      ANCHORSPLAT_RETURN_IF_ERROR(ReadCentral(at, end, directory.offset, entries, extents));
      if (!names.insert(entries.back().name).second) return Bad(at, entries.back().name, "occurs twice");
    }
    if (at != end) return Bad(at, Cat("the zip directory continues after its ", directory.entries, " entries"));
    std::sort(extents.begin(), extents.end(), [](const Extent& a, const Extent& b) { return a.begin < b.begin; });
    for (size_t i = 1; i < extents.size(); ++i) {
      if (extents[i].begin < extents[i - 1].end) return Bad(extents[i].begin, extents[i].name, "overlaps another");
    }
    return entries;
  }

 private:
  Error Bad(uint64_t at, const std::string& what) const {
    return {ErrorCode::kBadFile, Cat(file_, ": byte ", WithThousands(static_cast<int64_t>(at)), ": ", what)};
  }
  Error Bad(uint64_t at, std::string_view entry, const std::string& what) const {
    return Bad(at, Cat("zip entry \"", Printable(std::string(entry)), "\" ", what));
  }

  bool Has(uint64_t at, uint64_t bytes) const { return at <= archive_.size() && bytes <= archive_.size() - at; }
  uint16_t U16(uint64_t at) const { return LoadLittleEndian<uint16_t>(archive_.data() + at); }
  uint32_t U32(uint64_t at) const { return LoadLittleEndian<uint32_t>(archive_.data() + at); }
  uint64_t U64(uint64_t at) const { return LoadLittleEndian<uint64_t>(archive_.data() + at); }
  std::string_view Text(uint64_t at, uint64_t bytes) const {
    return {reinterpret_cast<const char*>(archive_.data()) + at, static_cast<size_t>(bytes)};
  }

  Result<Directory> FindDirectory() const {
    const uint64_t size = archive_.size();
    // The end record is last, followed only by a comment of at most 64 kB with a known length.
    uint64_t at = size < kEndSize ? 0 : size - kEndSize;
    const uint64_t lowest = at > 0xffff ? at - 0xffff : 0;
    while (!(Has(at, kEndSize) && U32(at) == kEndMagic && at + kEndSize + U16(at + 20) == size)) {
      if (at == lowest) {
        return Error{ErrorCode::kBadFile,
                     Cat(file_, ": the zip archive has no end record: the file is cut off or damaged (",
                         WithThousands(static_cast<int64_t>(size)), " bytes)")};
      }
      --at;
    }
    uint64_t disk = U16(at + 4);
    Directory directory{U32(at + 16), U32(at + 12), U16(at + 10)};
    uint64_t records = at;  // the directory ends before the end records
    if (at >= kLocator64Size && U32(at - kLocator64Size) == kLocator64Magic) {
      const uint64_t at64 = U64(at - kLocator64Size + 8);
      if (!Has(at64, kEnd64Size) || at64 + kEnd64Size > at - kLocator64Size || U32(at64) != kEnd64Magic) {
        return Bad(at - kLocator64Size, "the zip64 locator points at no zip64 end record");
      }
      disk = U32(at64 + 16);
      directory = {U64(at64 + 48), U64(at64 + 40), U64(at64 + 32)};
      records = at64;
    }
    if (disk != 0) return Bad(at, "the zip archive is split over several files");
    if (directory.offset > records || directory.size > records - directory.offset) {
      return Bad(at, Cat("the zip directory (", directory.size, " bytes at ", directory.offset,
                         ") lies outside the file: it is cut off or damaged"));
    }
    // Bounds loop and allocations by the actual bytes.
    if (directory.entries > directory.size / kCentralSize) {
      return Bad(at,
                 Cat("the zip directory of ", directory.size, " bytes cannot hold ", directory.entries, " entries"));
    }
    return directory;
  }

  // Replaces fields marked as zip64 by those of the extra field, which are in this order.
  bool ApplyZip64(uint64_t at, uint64_t length, uint64_t& stored, uint64_t& packed, uint64_t& header) const {
    const uint64_t end = at + length;
    while (end - at >= 4) {
      const uint16_t id = U16(at);
      const uint64_t bytes = U16(at + 2);
      at += 4;
      if (bytes > end - at) return false;
      if (id == 1) {
        const uint64_t field_end = at + bytes;
        for (uint64_t* field : {&stored, &packed, &header}) {
          if (*field != kIn64Field) continue;
          if (field_end - at < 8) return false;
          *field = U64(at);
          at += 8;
        }
        return true;
      }
      at += bytes;
    }
    return stored != kIn64Field && packed != kIn64Field && header != kIn64Field;
  }

  // Reads the central record at `at` and advances it.
  Status ReadCentral(uint64_t& at, uint64_t end, uint64_t data_end, std::vector<ZipEntry>& entries,
                     std::vector<Extent>& extents) const {
    if (end - at < kCentralSize || U32(at) != kCentralMagic) {
      return Bad(at, "an entry of the zip directory was expected");
    }
    const uint16_t flags = U16(at + 8);
    const uint16_t method = U16(at + 10);
    uint64_t packed = U32(at + 20);
    uint64_t stored = U32(at + 24);
    const uint64_t name_length = U16(at + 28);
    const uint64_t extra_length = U16(at + 30);
    const uint64_t comment_length = U16(at + 32);
    uint64_t header = U32(at + 42);
    if (name_length + extra_length + comment_length > end - at - kCentralSize) {
      return Bad(at, "this entry of the zip directory reaches past its end");
    }
    const std::string_view name = Text(at + kCentralSize, name_length);
    if ((flags & 1) != 0) return Bad(at, name, "is encrypted");
    if (!ApplyZip64(at + kCentralSize + name_length, extra_length, stored, packed, header)) {
      return Bad(at, name, "has a damaged zip64 field");
    }
    if (method == 0 && packed != stored) return Bad(at, name, "is not compressed but has two different sizes");
    if (header > data_end || data_end - header < kLocalSize || U32(header) != kLocalMagic) {
      return Bad(at, name, "has no local header where the directory says");
    }
    // The lengths of name and extra field differ from the central ones: torch pads the local ones for alignment.
    const uint64_t data = header + kLocalSize + U16(header + 26) + U16(header + 28);
    if (data > data_end || packed > data_end - data)
      return Bad(at, name, "reaches past the end of the data: the file is cut off or damaged");
    if (Text(header + kLocalSize, U16(header + 26)) != name)
      return Bad(header, name, "has another name in its local header");
    entries.push_back({name, archive_.subspan(data, packed), method, stored, U32(at + 16)});
    extents.push_back({header, data + packed, name});
    at += kCentralSize + name_length + extra_length + comment_length;
    return {};
  }

  std::span<const std::byte> archive_;
  const std::string& file_;
};

}  // namespace

Result<std::vector<ZipEntry>> ReadZipDirectory(std::span<const std::byte> archive, const std::string& file) {
  return DirectoryReader(archive, file).Read();
}

}  // namespace anchorsplat
