#include "formats/cloud_bytes.h"

#include <filesystem>
#include <string>
#include <utility>

#include "core/text.h"
#include "formats/opened_splat.h"
#include "formats/registry.h"
#include "io/input_file.h"
#include "io/output_memory.h"

namespace anchorsplat {

namespace {

constexpr const char* kInMemory = "bytes in memory";  // name in messages

Result<const SplatFormat*> FormatCalled(std::string_view name) {
  if (const SplatFormat* format = FormatOfName(name)) return format;
  return Error{ErrorCode::kBadArgument, Cat("\"", Printable(std::string(name)), "\" is not a splat format")};
}

}  // namespace

Result<GaussianCloud> ReadCloudBytes(std::span<const std::byte> bytes, std::string_view format) {
  const SplatFormat* known = nullptr;
  if (!format.empty()) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(known, FormatCalled(format));
  }
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  ANCHORSPLAT_ASSIGN_OR_RETURN(const OpenedSplat file, OpenedSplat::Of(InputFile::View(kInMemory, text), known));
  return file.Read();
}

Result<std::vector<std::byte>> WriteCloudBytes(const CloudView& cloud, std::string_view format_name,
                                               const CloudWriteOptions& write) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const SplatFormat* format, FormatCalled(format_name));
  // Of a format's names for several files or one archive, use the archive.
  const std::filesystem::path path = Cat(kInMemory, format->extensions.front());
  if (format->several_files ||
      (format->written_beside != nullptr && !format->written_beside(path, kMaxShDegree).empty())) {
    return Error{ErrorCode::kBadArgument,
                 Cat(format->name, " consists of several files and cannot be written into memory as one")};
  }
  OutputMemory memory;
  CloudWriteOptions options = write;
  options.memory = &memory;
  ANCHORSPLAT_RETURN_IF_ERROR(WriteCloud(path, cloud, options));
  return std::move(memory.files.at(path));
}

}  // namespace anchorsplat
