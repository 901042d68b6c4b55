#include "formats/sog/sog_members.h"

#include <string_view>
#include <system_error>
#include <utility>

#include "core/text.h"
#include "io/compression_ratio.h"
#include "io/input_record.h"

namespace anchorsplat {

namespace {

constexpr uint64_t kMaxArchive = uint64_t{8} << 30;
constexpr uint64_t kMaxMeta = uint64_t{4} << 20;
constexpr uint64_t kMaxPicture = uint64_t{1} << 30;

// Members must be in meta.json's own folder.
bool IsPlainName(const std::string& member) {
  return !member.empty() && member.find_first_of("/\\:") == member.npos && !member.starts_with(".") &&
         member.find('\0') == member.npos;
}

}  // namespace

std::optional<std::string> FolderOfSog(const std::vector<std::string>& members) {
  constexpr std::string_view kMeta = "meta.json";
  std::optional<std::string> folder;
  for (const std::string& member : members) {
    if (member == kMeta) return "";
    if (!member.ends_with("/meta.json") || member.starts_with("__MACOSX/")) continue;
    if (folder) return std::nullopt;
    folder = member.substr(0, member.size() - kMeta.size());
  }
  return folder;
}

Result<SogMembers> SogMembers::Of(const InputFile& file) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string head, file.Head(2));
  SogMembers members;
  members.name_ = file.name();
  if (head == "PK") {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string_view bytes, file.Contents(kMaxArchive));
    ANCHORSPLAT_ASSIGN_OR_RETURN(ZipReader archive, ZipReader::View(file.name(), bytes));
    members.folder_in_archive_ = FolderOfSog(archive.Members()).value_or("");
    members.archive_.emplace(std::move(archive));
  } else {
    members.file_ = &file;
    members.folder_ = file.path().parent_path();
  }
  return members;
}

Result<std::string> SogMembers::Meta(const InputFile& file) const {
  return archive_ ? archive_->Read(folder_in_archive_ + "meta.json", kMaxMeta) : file.ReadAll(kMaxMeta);
}

uint64_t SogMembers::SizeBeside(const std::string& name) const {
  std::error_code failed;
  const uint64_t size = IsPlainName(name) ? std::filesystem::file_size(folder_ / name, failed) : 0;
  if (size > 0) RecordInput(folder_ / name);
  return failed ? 0 : size;
}

Result<ByteImage> SogMembers::Picture(const JsonValue& name, int64_t min_pixels, int64_t max_pixels) const {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string member, name.Text());
  if (!IsPlainName(member)) {
    return name.Complain(Cat("expected the name of a file beside it, found \"", Printable(member), "\""));
  }
  std::string bytes;
  if (archive_) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(bytes, archive_->Read(folder_in_archive_ + member, kMaxPicture));
  } else {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const InputFile file, file_->OpenBeside(member));
    ANCHORSPLAT_ASSIGN_OR_RETURN(bytes, file.ReadAll(kMaxPicture));
  }
  const std::string where = archive_ ? Cat(name_, ": ", member) : (folder_ / member).string();
  ANCHORSPLAT_RETURN_IF_ERROR(CheckCompressionRatio(where, bytes.size(), static_cast<uint64_t>(min_pixels) * 2));
  return DecodeWebp(where, bytes, min_pixels, max_pixels);
}

Result<OpenedSog> OpenSog(const InputFile& file) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(SogMembers members, SogMembers::Of(file));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string text, members.Meta(file));
  ANCHORSPLAT_ASSIGN_OR_RETURN(JsonFile json, JsonFile::Parse(members.meta_name(), text));
  return OpenedSog{std::move(members), std::move(json)};
}

}  // namespace anchorsplat
