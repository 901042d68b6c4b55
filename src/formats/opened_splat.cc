#include "formats/opened_splat.h"

#include <memory>
#include <new>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "core/file_system.h"
#include "core/memory_limit.h"
#include "core/text.h"
#include "formats/extra_properties.h"
#include "io/input_record.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

std::string ReadFormats() {
  std::string list;
  for (const SplatFormat& format : Formats()) {
    if (format.read == nullptr) continue;
    list += Cat(list.empty() ? "" : ", ", format.name, " (", format.extensions.front(), ")");
  }
  return list;
}

// What people take for a splat, by its first bytes: "a PNG picture"; empty for anything else.
std::string OtherKind(std::string_view head) {
  constexpr std::pair<std::string_view, const char*> kKinds[] = {{"\x89PNG", "a PNG picture"},
                                                                 {"\xff\xd8\xff", "a JPEG picture"},
                                                                 {"RIFF", "a WebP picture or a sound"},
                                                                 {"GIF8", "a GIF picture"},
                                                                 {"%PDF", "a PDF document"},
                                                                 {"<!DOCTYPE", "a web page"},
                                                                 {"<!doctype", "a web page"},
                                                                 {"<html", "a web page"},
                                                                 {"7z\xbc\xaf", "an archive to be unpacked first"},
                                                                 {"Rar!", "an archive to be unpacked first"}};
  for (const auto& [mark, kind] : kKinds) {
    if (head.starts_with(mark)) return kind;
  }
  return {};
}

}  // namespace

fs::path SplatPath(const fs::path& path) {
  if (!IsFolder(path)) return path;
  for (const char* name : {"meta.json", "lod-meta.json"}) {
    if (fs::path meta = path / name; Exists(meta)) return meta;
  }
  return path;
}

Result<OpenedSplat> OpenedSplat::Open(const fs::path& path, const SplatFormat* format) {
  const fs::path found = SplatPath(path);
  if (IsFolder(found)) {
    return Error{
        ErrorCode::kBadFile,
        Cat(path.string(),
            ": is a folder without a meta.json or lod-meta.json: expected a splat file or the folder of a SOG")};
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(InputFile input, InputFile::Open(found));
  return Of(std::move(input), format);
}

Result<OpenedSplat> OpenedSplat::Of(InputFile input, const SplatFormat* format) {
  if (format == nullptr) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string head, input.Head(kSniffBytes));
    format = FormatOfFile(head, input.path());
  }
  return OpenedSplat(std::move(input), format);
}

uint64_t OpenedSplat::bytes() const {
  return format_ != nullptr && format_->size != nullptr ? format_->size(input_) : input_.size();
}

std::optional<CloudExtent> OpenedSplat::Extent() const {
  if (format_ == nullptr || format_->extent == nullptr) return std::nullopt;
  const Result<CloudExtent> extent = format_->extent(input_);
  return extent.ok() ? std::optional(*extent) : std::nullopt;
}

Result<GaussianCloud> OpenedSplat::Read(const ReadLimits& limits, ExtraProperties* extras) const try {
  if (format_ == nullptr) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string head, input_.Head(16));
    if (const std::string kind = OtherKind(head); !kind.empty()) {
      return Error{ErrorCode::kBadFile, Cat(input_.name(), ": is ", kind, " and no splat; expected ", ReadFormats())};
    }
    return Error{ErrorCode::kBadFile, Cat(input_.name(), ": byte 0: is no splat file of a known format: found \"",
                                          Printable(head.substr(0, 8)), "\", expected ", ReadFormats())};
  }
  if (format_->read == nullptr) {
    return Error{ErrorCode::kBadFile,
                 Cat(input_.name(), ": is ", format_->article, " ", format_->name, " file, which this version ",
                     format_->write != nullptr ? "writes for other programs and " : "",
                     "does not read; give the splat that it was made from, as ", ReadFormats())};
  }
  if (extras != nullptr && format_->read_with_extras != nullptr) {
    return format_->read_with_extras(input_, limits, *extras);
  }
  return format_->read(input_, limits);
} catch (const NoDiskRoom& none) {
  return Error{ErrorCode::kIo, Cat(input_.name(), ": ", none.what())};
} catch (const std::bad_alloc&) {
  return Error{ErrorCode::kIo, Cat(input_.name(), ": there is not enough memory for its Gaussians")};
}

std::optional<CloudExtent> ExtentOf(const fs::path& path, const SplatFormat* format) {
  if (path == "-" || !IsFile(SplatPath(path))) return std::nullopt;
  const Result<OpenedSplat> file = OpenedSplat::Open(path, format);
  return file.ok() ? file->Extent() : std::nullopt;
}

Result<std::unique_ptr<CloudBlocks>> OpenedSplat::Blocks(const ReadLimits& limits) const {
  if (format_ != nullptr && format_->blocks != nullptr) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(std::unique_ptr<CloudBlocks> blocks, format_->blocks(input_, limits));
    if (blocks != nullptr) return blocks;
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(GaussianCloud cloud, Read(limits));
  return std::unique_ptr<CloudBlocks>(std::make_unique<MemoryBlocks>(std::move(cloud)));
}

void RecordSplat(const fs::path& path) {
  if (path == "-") return RecordInput(path);
  const fs::path found = SplatPath(path);
  RecordInput(found);
  if (!IsFile(found)) return;  // a pipe can be read only once
  const Result<OpenedSplat> file = OpenedSplat::Open(path);
  if (!file.ok()) return;
  const Result<std::string> head = file->input().Head(2);
  if (head.ok() && *head != "PK") (void)file->bytes();  // looks at all of them; an archive has none, and would be read
}

}  // namespace anchorsplat
