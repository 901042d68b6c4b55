#include "formats/zip_archive.h"

#include <zip.h>
#include <zlib.h>

#include <algorithm>
#include <mutex>
#include <utility>

#include "core/text.h"
#include "formats/cloud_checks.h"

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

constexpr uint16_t kVersion = 45;            // that knows the 64-bit extensions
constexpr uint16_t kUtf8 = 0x0800;           // names are UTF-8
constexpr uint32_t kFirstOf1980 = 0x210000;  // date 1980-01-01, time 0:00

}  // namespace

struct ZipReader::State {
  std::string name, bytes;
  zip_t* archive = nullptr;
  std::mutex reading;  // libzip's archives are for one thread

  ~State() {
    if (archive != nullptr) zip_discard(archive);
  }
};

ZipReader::ZipReader() : state_(std::make_unique<State>()) {}
ZipReader::ZipReader(ZipReader&&) noexcept = default;
ZipReader& ZipReader::operator=(ZipReader&&) noexcept = default;
ZipReader::~ZipReader() = default;

Result<ZipReader> ZipReader::Open(std::string name, std::string bytes) {
  ZipReader reader;
  State& state = *reader.state_;
  state.name = std::move(name);
  state.bytes = std::move(bytes);
  zip_error_t error;
  zip_error_init(&error);
  zip_source_t* source = zip_source_buffer_create(state.bytes.data(), state.bytes.size(), 0, &error);
  if (source != nullptr) {
    state.archive = zip_open_from_source(source, ZIP_RDONLY, &error);
    if (state.archive == nullptr) zip_source_free(source);
  }
  const std::string reason = zip_error_strerror(&error);
  zip_error_fini(&error);
  if (state.archive == nullptr) {
    return Error{ErrorCode::kBadFile, Cat(state.name, ": is no readable ZIP archive (", reason, ")")};
  }
  return reader;
}

Result<std::string> ZipReader::Read(const std::string& member, uint64_t max_size) const {
  const std::string where = Cat(state_->name, ": ", Printable(member));
  const std::lock_guard lock(state_->reading);
  zip_stat_t stat;
  zip_stat_init(&stat);
  if (zip_stat(state_->archive, member.c_str(), ZIP_FL_ENC_RAW, &stat) != 0) {
    return Error{ErrorCode::kBadFile, Cat(where, ": is not in the archive")};
  }
  if ((stat.valid & ZIP_STAT_SIZE) == 0 || (stat.valid & ZIP_STAT_COMP_SIZE) == 0 || stat.size > max_size) {
    return Error{ErrorCode::kBadFile,
                 Cat(where, ": has ", HumanBytes(stat.size), ", at most ", HumanBytes(max_size), " expected")};
  }
  ANCHORSPLAT_RETURN_IF_ERROR(CheckRatio(where, std::min<uint64_t>(stat.comp_size, state_->bytes.size()), stat.size));
  zip_file_t* file = zip_fopen_index(state_->archive, stat.index, 0);
  if (file == nullptr) {
    return Error{ErrorCode::kBadFile, Cat(where, ": cannot be read (", zip_strerror(state_->archive), ")")};
  }
  std::string contents(static_cast<size_t>(stat.size), '\0');
  const zip_int64_t size = zip_fread(file, contents.data(), contents.size());
  // One byte more: the check sum is only looked at where the member ends.
  char end = 0;
  const bool complete = size == static_cast<zip_int64_t>(stat.size) && zip_fread(file, &end, 1) == 0;
  zip_fclose(file);
  if (!complete) return Error{ErrorCode::kBadFile, Cat(where, ": is damaged or cut off")};
  return contents;
}

std::vector<std::string> ZipReader::Members() const {
  std::vector<std::string> names;
  const std::lock_guard lock(state_->reading);
  const zip_int64_t count = zip_get_num_entries(state_->archive, 0);
  for (zip_int64_t i = 0; i < count; ++i) {
    const char* name = zip_get_name(state_->archive, static_cast<zip_uint64_t>(i), ZIP_FL_ENC_RAW);
    if (name != nullptr) names.emplace_back(name);
  }
  return names;
}

Status ZipWriter::Add(const std::string& name, std::span<const std::string_view> parts) {
  Member member{name, 0, 0, written_};
  uLong crc = crc32(0, nullptr, 0);
  for (std::string_view part : parts) {
    member.size += part.size();
    while (!part.empty()) {
      const size_t chunk = std::min(part.size(), size_t{1} << 30);
      crc = crc32(crc, reinterpret_cast<const Bytef*>(part.data()), static_cast<uInt>(chunk));
      part.remove_prefix(chunk);
    }
  }
  member.crc = static_cast<uint32_t>(crc);
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
