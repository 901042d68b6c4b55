#include <anchorsplat/files.h>

#include "api/bridge.h"
#include "core/text.h"
#include "formats/cloud_io.h"
#include "formats/opened_splat.h"
#include "formats/registry.h"
#include "io/input_file.h"
#include "io/output_memory.h"

namespace anchorsplat {

namespace {

constexpr const char* kInMemory = "bytes in memory";  // what messages call them

CloudWriteOptions ToOptions(const WriteSettings& settings) {
  CloudWriteOptions options{.overwrite = settings.overwrite, .spz_version = settings.spz_version};
  switch (settings.order) {
    case GaussianOrder::kFormat:
      options.order = SplatOrder::kFormat;
      break;
    case GaussianOrder::kKeep:
      options.order = SplatOrder::kKeep;
      break;
    case GaussianOrder::kMorton:
      options.order = SplatOrder::kMorton;
      break;
    case GaussianOrder::kImportance:
      options.order = SplatOrder::kImportance;
      break;
  }
  return options;
}

Result<const SplatFormat*> FormatCalled(std::string_view name) {
  if (const SplatFormat* format = FormatOfName(name)) return format;
  return Error{ErrorCode::kBadArgument, Cat("\"", Printable(std::string(name)), "\" is no splat format")};
}

Result<std::vector<std::byte>> ToBytes(const CloudView& cloud, std::string_view name, const WriteSettings& settings) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const SplatFormat* format, FormatCalled(name));
  // Of the names that stand for one format of several files or one archive of them, the one that is an archive.
  const std::filesystem::path path = Cat(kInMemory, format->extensions.front());
  if (format->written_beside != nullptr && !format->written_beside(path, kMaxShDegree).empty()) {
    return Error{ErrorCode::kBadArgument,
                 Cat(format->name, " consists of several files and cannot be written into ", "memory as one")};
  }
  OutputMemory memory;
  CloudWriteOptions options = ToOptions(settings);
  options.memory = &memory;
  ANCHORSPLAT_RETURN_IF_ERROR(WriteCloud(path, cloud, options));
  return std::move(memory.files.at(path));
}

}  // namespace

std::vector<FileFormat> FileFormats() {
  std::vector<FileFormat> formats;
  for (const SplatFormat& format : Formats()) {
    formats.push_back({.name = std::string(format.name),
                       .extensions = {format.extensions.begin(), format.extensions.end()},
                       .is_read = format.read != nullptr,
                       .is_written = format.write != nullptr});
  }
  return formats;
}

Expected<Splat> ReadSplat(const std::filesystem::path& path, const RunSettings& run) {
  return InRun<Splat>(run, [&]() -> Result<Splat> {
    ANCHORSPLAT_ASSIGN_OR_RETURN(GaussianCloud cloud, ReadCloud(path));
    return SplatAccess::Make(std::move(cloud));
  });
}

Expected<Splat> ReadSplat(std::span<const std::byte> bytes, std::string_view format, const RunSettings& run) {
  return InRun<Splat>(run, [&]() -> Result<Splat> {
    const SplatFormat* known = nullptr;
    if (!format.empty()) {
      ANCHORSPLAT_ASSIGN_OR_RETURN(known, FormatCalled(format));
    }
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    ANCHORSPLAT_ASSIGN_OR_RETURN(const OpenedSplat file, OpenedSplat::Of(InputFile::View(kInMemory, text), known));
    ANCHORSPLAT_ASSIGN_OR_RETURN(GaussianCloud cloud, file.Read());
    return SplatAccess::Make(std::move(cloud));
  });
}

Expected<void> WriteSplat(const std::filesystem::path& path, const SplatView& splat, const WriteSettings& settings,
                          const RunSettings& run) {
  return InRun<void>(run, [&] { return WriteCloud(path, ToCloud(splat), ToOptions(settings)); });
}

Expected<std::vector<std::byte>> WriteSplatBytes(const SplatView& splat, std::string_view format,
                                                 const WriteSettings& settings, const RunSettings& run) {
  return InRun<std::vector<std::byte>>(run, [&] { return ToBytes(ToCloud(splat), format, settings); });
}

}  // namespace anchorsplat
