#include "formats/opened_splat.h"

#include <memory>
#include <new>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "core/file_system.h"
#include "core/log.h"
#include "core/memory_limit.h"
#include "core/text.h"
#include "formats/extra_properties.h"
#include "formats/splat_folder.h"
#include "formats/wrapped_splat.h"
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

// What a user may have meant by something that is not a splat; empty if unclear.
std::string HintFor(const fs::path& path, std::string_view head) {
  constexpr const char* kPass =
      ", not a splat; pass cameras with --cameras, pictures as their folder, or the project to `fit`";
  if (IsFolder(path)) {
    for (const char* part : {"sparse", "cameras.bin", "cameras.txt", "transforms.json", "transforms_train.json"}) {
      if (Exists(path / part)) return Cat("; it looks like a project with cameras", kPass);
    }
    return {};
  }
  const std::string name = path.filename().string();
  for (const char* part : {"cameras", "images", "points3D"}) {
    if (name == Cat(part, ".bin") || name == Cat(part, ".txt"))
      return Cat("; it looks like part of a COLMAP model", kPass);
  }
  for (const char* key : {"\"transform_matrix\"", "\"camera_angle_x\"", "\"fl_x\"", "\"img_name\""}) {
    if (head.find(key) != head.npos) return Cat("; it looks like a camera file", kPass);
  }
  return {};
}

// Whether it must be decompressed or read whole to learn anything about it.
bool IsWrapped(const fs::path& path) {
  const Result<InputFile> file = InputFile::Open(path);
  return file.ok() && IsWrapped(*file);
}

}  // namespace

fs::path SplatPath(const fs::path& path) { return path == "-" ? path : FindSplat(path).path; }

Result<OpenedSplat> OpenedSplat::Open(const fs::path& path, const SplatFormat* format) {
  const FoundSplat found = path == "-" ? FoundSplat{path, {}} : FindSplat(path);
  if (IsFolder(found.path)) {
    return Error{ErrorCode::kBadFile,
                 Cat(path.string(),
                     ": is a folder without a meta.json, a lod-meta.json or a trainer's results: expected a "
                     "splat file, or the folder of one",
                     HintFor(found.path, {}))};
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(InputFile input, InputFile::Open(found.path));
  if (found.by_step) {
    LogInfo(Cat(path.string(), ": using its latest splat, ", found.path.string(),
                found.others.empty() ? "" : Cat("; others: ", found.others)));
  }
  return Of(std::move(input), format);
}

Result<OpenedSplat> OpenedSplat::Of(InputFile input, const SplatFormat* format) {
  const std::string name = input.name();
  try {
    const uint64_t size = input.size();
    if (size == 0) return Error{ErrorCode::kBadFile, Cat(input.name(), ": is empty, expected a splat file")};
    ANCHORSPLAT_ASSIGN_OR_RETURN(UnwrappedSplat found, Unwrap(std::move(input)));
    InputFile& file = found.file;
    if (file.size() == 0) return Error{ErrorCode::kBadFile, Cat(file.name(), ": is empty, expected a splat file")};
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string head, file.Head(kSniffBytes));
    if (const std::string what = DescribeNonSplat(head); !what.empty()) {
      return Error{ErrorCode::kBadFile, Cat(file.name(), ": ", what, "; expected ", ReadFormats())};
    }
    if (format == nullptr) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(format, FormatOfFile(file, found.name));
    }
    if (format != nullptr && format->looks_like != nullptr && IsText(head) && !format->looks_like(file)) {
      return Error{ErrorCode::kBadFile, Cat(file.name(), ": is text, not a ", format->extensions.front(),
                                            " file; it begins with \"", Printable(head.substr(0, 60)), "\"")};
    }
    OpenedSplat opened(std::move(file), format);
    opened.packed_ = std::move(found.packed);
    if (!opened.packed_.empty()) opened.packed_bytes_ = size;
    return opened;
  } catch (const DiskFull& none) {
    return Error{ErrorCode::kIo, Cat(name, ": ", none.what())};
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::kIo, Cat(name, ": not enough memory to unpack it")};
  }
}

uint64_t OpenedSplat::bytes() const {
  if (!packed_.empty()) return packed_bytes_;
  return format_ != nullptr && format_->size != nullptr ? format_->size(input_) : input_.size();
}

std::optional<CloudExtent> OpenedSplat::Extent() const {
  if (format_ == nullptr || format_->extent == nullptr) return std::nullopt;
  const Result<CloudExtent> extent = format_->extent(input_);
  return extent.ok() ? std::optional(*extent) : std::nullopt;
}

Result<GaussianCloud> OpenedSplat::Read(const ReadLimits& limits, ExtraProperties* extras) const try {
  if (format_ == nullptr) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string head, input_.Head(kSniffBytes));
    std::string hint = HintFor(input_.path(), head);
    if (hint.empty() && !IsText(head.substr(0, 16))) {
      hint = "; .splat and .ksplat files are recognised by name only: rename the file, or use convert --from .splat";
    }
    const std::string found =
        Cat(input_.name(), ": byte 0: is not in a known splat format: found \"", Printable(head.substr(0, 8)), "\"");
    return Error{ErrorCode::kBadFile, Cat(found, hint.empty() ? Cat("; expected ", ReadFormats()) : hint)};
  }
  if (format_->read == nullptr) {
    return Error{ErrorCode::kBadFile,
                 Cat(input_.name(), ": is ", format_->article, " ", format_->name, " file, which ",
                     format_->write != nullptr ? "can be written but not read" : "is not supported",
                     "; pass the splat it was made from, as ", ReadFormats())};
  }
  if (extras != nullptr && format_->read_with_extras != nullptr) {
    return format_->read_with_extras(input_, limits, *extras);
  }
  return format_->read(input_, limits);
} catch (const DiskFull& none) {
  return Error{ErrorCode::kIo, Cat(input_.name(), ": ", none.what())};
} catch (const std::bad_alloc&) {
  return Error{ErrorCode::kIo, Cat(input_.name(), ": not enough memory for its Gaussians")};
}

std::optional<CloudExtent> ExtentOf(const fs::path& path, const SplatFormat* format) {
  if (path == "-" || !IsFile(SplatPath(path)) || IsWrapped(SplatPath(path))) return std::nullopt;
  const Result<OpenedSplat> file = OpenedSplat::Open(SplatPath(path), format);
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
  // Pipes can be read only once. Compressed files would be decompressed, and rarely have files beside them.
  if (!IsFile(found) || IsWrapped(found)) return;
  const Result<OpenedSplat> file = OpenedSplat::Open(found);
  if (file.ok()) (void)file->bytes();  // records all of them
}

}  // namespace anchorsplat
