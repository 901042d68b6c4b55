#include "io/zip_archive.h"

#include <zlib.h>

#include <algorithm>
#include <mutex>
#include <utility>

#include "core/text.h"
#include "io/compression_ratio.h"
#include "io/size_limit.h"

namespace anchorsplat {

namespace {

constexpr uint32_t kLimit32 = 0xffffffff;

// Little-endian numbers of a ZIP record.
class Record {
 public:
  Record& U16(uint64_t value) { return Number(value, 2); }
  Record& U32(uint64_t value) { return Number(value, 4); }
  Record& U64(uint64_t value) { return Number(value, 8); }
  Record& Text(const std::string& text) {
    bytes_ += text;
    return *this;
  }
  const std::string& bytes() const { return bytes_; }

 private:
  Record& Number(uint64_t value, int size) {
    for (int k = 0; k < size; ++k) bytes_ += static_cast<char>(value >> (8 * k) & 255);
    return *this;
  }
  std::string bytes_;
};

uint32_t Crc(uint32_t crc, std::string_view bytes) {
  while (!bytes.empty()) {  // zlib counts in 32 bits
    const size_t chunk = std::min(bytes.size(), size_t{1} << 30);
    crc = static_cast<uint32_t>(crc32(crc, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(chunk)));
    bytes.remove_prefix(chunk);
  }
  return crc;
}

// Inflates a raw deflate stream that must give exactly contents.size() bytes.
bool Inflate(std::span<const std::byte> packed, std::string& contents) {
  z_stream stream{};
  if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) throw std::bad_alloc();
  constexpr size_t kMost = size_t{1} << 30;
  size_t in = 0, out = 0;
  int code = Z_OK;
  char beyond = 0;  // lets inflate reach the end of the stream, and catches one byte too many
  while (code == Z_OK) {
    const auto in_chunk = static_cast<uInt>(std::min(kMost, packed.size() - in));
    const auto out_chunk = static_cast<uInt>(std::min(kMost, contents.size() - out));
    stream.next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(packed.data() + in));
    stream.avail_in = in_chunk;
    stream.next_out = reinterpret_cast<Bytef*>(out_chunk > 0 ? contents.data() + out : &beyond);
    stream.avail_out = out_chunk > 0 ? out_chunk : 1;
    code = inflate(&stream, Z_NO_FLUSH);
    in += in_chunk - stream.avail_in;
    if (out_chunk > 0) {
      out += out_chunk - stream.avail_out;
    } else if (stream.avail_out == 0) {
      break;
    }
  }
  inflateEnd(&stream);
  return code == Z_STREAM_END && out == contents.size();
}

constexpr uint16_t kVersion = 45;            // 4.5: with zip64
constexpr uint16_t kUtf8 = 0x0800;           // names are UTF-8
constexpr uint32_t kFirstOf1980 = 0x210000;  // date 1980-01-01, time 0:00

}  // namespace

Result<ZipReader> ZipReader::Open(std::string name, std::string bytes) {
  auto kept = std::make_unique<const std::string>(std::move(bytes));
  ANCHORSPLAT_ASSIGN_OR_RETURN(ZipReader reader, View(std::move(name), *kept));
  reader.bytes_ = std::move(kept);
  return reader;
}

Result<ZipReader> ZipReader::View(std::string name, std::string_view bytes) {
  ZipReader reader;
  reader.name_ = std::move(name);
  ANCHORSPLAT_ASSIGN_OR_RETURN(reader.entries_, ReadZipDirectory(std::as_bytes(std::span(bytes)), reader.name_));
  return reader;
}

std::vector<std::string> ZipReader::Members() const {
  std::vector<std::string> names;
  for (const ZipEntry& entry : entries_) names.emplace_back(entry.name);
  return names;
}

uint64_t ZipReader::SizeOf(const std::string& member) const {
  const auto entry = std::ranges::find(entries_, member, &ZipEntry::name);
  return entry == entries_.end() ? 0 : entry->size;
}

Result<std::string> ZipReader::Read(const std::string& member, uint64_t max_size) const {
  const std::string where = Cat(name_, ": ", Printable(member));
  const auto entry = std::ranges::find(entries_, member, &ZipEntry::name);
  if (entry == entries_.end()) return Error{ErrorCode::kBadFile, Cat(where, ": is not in the archive")};
  if (entry->size > max_size) {
    return Error{ErrorCode::kBadFile, Cat(where, ": has ", MoreThanLimit(entry->size, max_size))};
  }
  std::string contents;
  if (entry->method == 0) {
    contents.assign(reinterpret_cast<const char*>(entry->data.data()), entry->data.size());
  } else if (entry->method == 8) {
    ANCHORSPLAT_RETURN_IF_ERROR(CheckCompressionRatio(where, entry->data.size(), entry->size));
    contents.resize(static_cast<size_t>(entry->size));
    if (!Inflate(entry->data, contents)) return Error{ErrorCode::kBadFile, Cat(where, ": is damaged or cut off")};
  } else {
    return Error{ErrorCode::kBadFile, Cat(where, ": is compressed by method ", entry->method, ", expected 0 or 8")};
  }
  if (Crc(0, contents) != entry->crc) {
    return Error{ErrorCode::kBadFile, Cat(where, ": is damaged: wrong check sum")};
  }
  return contents;
}

Status ZipWriter::Add(const std::string& name, std::span<const std::string_view> parts) {
  Member member{name, 0, 0, written_};
  for (const std::string_view part : parts) {
    member.size += part.size();
    member.crc = Crc(member.crc, part);
  }
  const bool large = member.size >= kLimit32;
  Record header;
  header.U32(0x04034b50).U16(kVersion).U16(kUtf8).U16(0).U32(kFirstOf1980).U32(member.crc);
  header.U32(large ? kLimit32 : member.size).U32(large ? kLimit32 : member.size);
  header.U16(name.size()).U16(large ? 20 : 0).Text(name);
  if (large) header.U16(1).U16(16).U64(member.size).U64(member.size);
  ANCHORSPLAT_RETURN_IF_ERROR(file_->Write(header.bytes()));
  written_ += header.bytes().size() + member.size;
  for (const std::string_view part : parts) ANCHORSPLAT_RETURN_IF_ERROR(file_->Write(part));
  members_.push_back(std::move(member));
  return {};
}

Status ZipWriter::Finish() {
  Record directory;
  for (const Member& member : members_) {
    const bool large = member.size >= kLimit32 || member.offset >= kLimit32;
    directory.U32(0x02014b50).U16(kVersion).U16(kVersion).U16(kUtf8).U16(0).U32(kFirstOf1980).U32(member.crc);
    directory.U32(large ? kLimit32 : member.size).U32(large ? kLimit32 : member.size).U16(member.name.size());
    directory.U16(large ? 28 : 0).U16(0).U16(0).U16(0).U32(0).U32(large ? kLimit32 : member.offset).Text(member.name);
    if (large) directory.U16(1).U16(24).U64(member.size).U64(member.size).U64(member.offset);
  }
  Record end;
  const uint64_t size = directory.bytes().size();
  const bool large = written_ >= kLimit32 || members_.size() >= 0xffff;
  if (large) {
    end.U32(0x06064b50).U64(44).U16(kVersion).U16(kVersion).U32(0).U32(0).U64(members_.size()).U64(members_.size());
    end.U64(size).U64(written_).U32(0x07064b50).U32(0).U64(written_ + size).U32(1);
  }
  const uint64_t count = large ? 0xffff : members_.size();
  end.U32(0x06054b50).U16(0).U16(0).U16(count).U16(count).U32(std::min<uint64_t>(size, kLimit32));
  end.U32(large ? kLimit32 : written_).U16(0);
  ANCHORSPLAT_RETURN_IF_ERROR(file_->Write(directory.bytes()));
  return file_->Write(end.bytes());
}

}  // namespace anchorsplat
