#include "formats/wrapped_splat.h"

#include <algorithm>
#include <cctype>
#include <iterator>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "core/text.h"
#include "formats/registry.h"
#include "formats/sog/sog_members.h"
#include "io/compression_ratio.h"
#include "io/little_endian.h"
#include "io/unpack.h"
#include "io/zip_archive.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

constexpr int kMostWraps = 2;
constexpr uint64_t kLargestArchive = uint64_t{8} << 30;

Error Bad(const InputFile& file, const std::string& what) {
  return {ErrorCode::kBadFile, Cat(file.name(), ": ", what)};
}

// A general archive, not one that a format recognises by its start.
bool IsPlainZip(std::string_view head) {
  if (!head.starts_with("PK\x03\x04") && !head.starts_with("PK\x05\x06")) return false;
  const SplatFormat* const format = FormatOfFile(head, {});
  return format == nullptr || format->name == "SOG";
}

// An SPZ up to version 3 is itself a gzip stream.
Result<bool> IsSpzItself(const InputFile& file) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string inside, HeadInside(file, Packing::kGzip, 8));
  return inside.size() == 8 && inside.starts_with("NGSP") && LoadLittleEndian<uint32_t>(inside.data() + 4) < 4;
}

bool IsRead(const fs::path& name) {
  const SplatFormat* const format = FormatOfExtension(WithoutPacking(name));
  return format != nullptr && format->read != nullptr;
}

// Files that operating systems add to archives.
bool IsSystems(const std::string& member) {
  return member.ends_with('/') || member.starts_with("__MACOSX/") ||
         fs::path(member).filename().string().starts_with('.');
}

std::string Listed(const std::vector<std::string>& names) {
  constexpr size_t kMost = 5;
  std::string list;
  for (size_t k = 0; k < std::min(kMost, names.size()); ++k) list += (k == 0 ? "" : ", ") + Printable(names[k]);
  return names.size() > kMost ? Cat(list, " and ", names.size() - kMost, " more") : list;
}

// The splat member of an archive; none if the archive itself is a splat.
Result<std::optional<std::string>> SplatIn(const InputFile& file, const ZipReader& archive) {
  std::vector<std::string> members = archive.Members();
  std::erase_if(members, IsSystems);
  if (std::ranges::any_of(members, [](const fs::path& name) { return name.filename() == "lod-meta.json"; })) {
    return Bad(file, "is a ZIP archive of a streamed SOG: unpack it and pass its folder");
  }
  if (FolderOfSog(members)) return std::optional<std::string>();
  std::vector<std::string> splats;
  std::ranges::copy_if(members, std::back_inserter(splats), [](const std::string& name) { return IsRead(name); });
  if (splats.empty() && members.size() == 1) splats = members;  // whatever its name
  if (splats.size() == 1) return std::optional(splats.front());
  if (members.empty()) return Bad(file, "is an empty ZIP archive");
  if (splats.empty()) return Bad(file, Cat("is a ZIP archive without a splat; it contains ", Listed(members)));
  return Bad(file, Cat("is a ZIP archive with ", splats.size(), " splats (", Listed(splats),
                       "): unpack it and pass one of them"));
}

Result<std::optional<UnwrappedSplat>> TakeOutOfZip(const InputFile& file, uint64_t compressed_size) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string_view bytes, file.Contents(kLargestArchive));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const ZipReader archive, ZipReader::View(file.name(), bytes));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::optional<std::string> member, SplatIn(file, archive));
  if (!member) return std::optional<UnwrappedSplat>();
  const fs::path name = fs::path(*member).filename();
  const uint64_t size = archive.SizeOf(*member);
  ANCHORSPLAT_RETURN_IF_ERROR(CheckCompressionRatio(file.name(), compressed_size, size));
  ANCHORSPLAT_ASSIGN_OR_RETURN(std::string contents, archive.Read(*member, size));
  // Files beside the archive do not belong to its member.
  InputFile inside = InputFile::FromBytes(Cat(file.name(), ": ", Printable(*member)), std::move(contents));
  return std::optional(UnwrappedSplat{std::move(inside), name, Cat("ZIP archive around ", Printable(*member))});
}

Result<std::optional<UnwrappedSplat>> TakeOff(const UnwrappedSplat& outer, uint64_t compressed_size) {
  const InputFile& file = outer.file;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string head, file.Head(kSniffBytes));
  if (const Packing packing = PackingOf(head); packing != Packing::kNone) {
    if (packing == Packing::kGzip) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(const bool is_spz, IsSpzItself(file));
      if (is_spz) return std::optional<UnwrappedSplat>();
    }
    ANCHORSPLAT_ASSIGN_OR_RETURN(InputFile inside, Unpack(file, packing, compressed_size));
    fs::path name = WithoutPacking(outer.name);
    const std::string said = packing == Packing::kGzip ? NameInGzip(head) : "";
    if (!said.empty() && FormatOfExtension(name) == nullptr) name = fs::path(said).filename();
    const std::string packed = Cat(NameOf(packing), " around ", HumanBytes(inside.size()));
    return std::optional(UnwrappedSplat{std::move(inside), std::move(name), packed});
  }
  if (!IsPlainZip(head)) return std::optional<UnwrappedSplat>();
  return TakeOutOfZip(file, compressed_size);
}

struct Kind {
  std::string_view mark;
  const char* what;
};
constexpr Kind kKinds[] = {
    {"\x89PNG", "is a PNG picture, not a splat (`fit` makes a splat of pictures with cameras)"},
    {"\xff\xd8\xff", "is a JPEG picture, not a splat (`fit` makes a splat of pictures with cameras)"},
    {"RIFF", "is a WebP picture or a sound, not a splat"},
    {"GIF8", "is a GIF picture, not a splat"},
    {"%PDF", "is a PDF document, not a splat"},
    {"LASF", "is a LAS point cloud, not a splat"},
    {"ASTM-E57", "is an E57 point cloud, not a splat"},
    {std::string_view("\xfd"
                      "7zXZ\0",
                      6),
     "is compressed with xz, which is not supported: decompress it with unxz"},
    {"\x04\x22\x4d\x18", "is compressed with lz4, which is not supported: decompress it with unlz4"},
    {"7z\xbc\xaf", "is a 7z archive, which is not supported: unpack it and pass the splat in it"},
    {"Rar!", "is a RAR archive, which is not supported: unpack it and pass the splat in it"},
    {"version https://git-lfs", "is a Git LFS pointer, not the file itself: fetch it with git lfs pull"},
    {"/annex/objects/", "is a git-annex pointer, not the file itself: fetch it with git annex get"},
};
// Skips whitespace and ignores case.
constexpr Kind kTexts[] = {
    {"<!doctype html", "is a web page, not a splat: the download may need a login or another address"},
    {"<html", "is a web page, not a splat: the download may need a login or another address"},
    {"<?xml", "is an XML document, not a splat: a server may have sent it instead of the file"},
};

bool IsBzip2(std::string_view head) {
  return head.starts_with("BZh") && head.size() > 10 && head.substr(4, 6) == "1AY&SY";
}

bool IsTar(std::string_view head) { return head.size() >= 262 && head.substr(257, 5) == "ustar"; }

}  // namespace

fs::path WithoutPacking(const fs::path& name) {
  std::string ending = name.extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const bool known = ending == ".gz" || ending == ".gzip" || ending == ".zst" || ending == ".zstd" || ending == ".zip";
  return known ? name.stem() : name;
}

bool IsWrapped(const InputFile& file) {
  const Result<std::string> head = file.Head(kSniffBytes);
  if (!head.ok()) return false;
  if (PackingOf(*head) != Packing::kGzip) return PackingOf(*head) != Packing::kNone || IsPlainZip(*head);
  const Result<bool> is_spz = IsSpzItself(file);
  return !is_spz.ok() || !*is_spz;
}

Result<UnwrappedSplat> Unwrap(InputFile input) {
  const uint64_t compressed_size = input.size();
  fs::path name = input.path().filename();
  UnwrappedSplat found{std::move(input), std::move(name), {}};
  std::string packed;
  for (int wraps = 0;; ++wraps) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(std::optional<UnwrappedSplat> inside, TakeOff(found, compressed_size));
    if (!inside) break;
    if (wraps == kMostWraps) return Bad(found.file, "is packed more than twice: unpack it first");
    packed += Cat(packed.empty() ? "" : ", in it ", inside->packed);
    found = *std::move(inside);
  }
  found.packed = std::move(packed);
  return found;
}

bool IsText(std::string_view head) {
  return std::ranges::all_of(head, [](unsigned char c) { return c >= ' ' || c == '\t' || c == '\n' || c == '\r'; });
}

std::string DescribeNonSplat(std::string_view head) {
  for (const auto& [mark, what] : kKinds) {
    if (head.starts_with(mark)) return what;
  }
  if (IsBzip2(head)) return "is compressed with bzip2, which is not supported: decompress it with bunzip2";
  if (IsTar(head)) return "is a tar archive, which is not supported: unpack it with tar -xf and pass the splat in it";
  std::string text(head.substr(0, 256));
  text.erase(0, text.starts_with("\xef\xbb\xbf") ? 3 : 0);
  text.erase(0, text.find_first_not_of(" \t\r\n"));
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const auto& [mark, what] : kTexts) {
    if (text.starts_with(mark)) return what;
  }
  return {};
}

}  // namespace anchorsplat
