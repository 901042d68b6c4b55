#include <anchorsplat/files.h>

#include "api/bridge.h"
#include "formats/cloud_bytes.h"
#include "formats/cloud_io.h"
#include "formats/registry.h"

namespace anchorsplat {

namespace {

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
    ANCHORSPLAT_ASSIGN_OR_RETURN(GaussianCloud cloud, ReadCloudBytes(bytes, format));
    return SplatAccess::Make(std::move(cloud));
  });
}

Expected<void> WriteSplat(const std::filesystem::path& path, const SplatView& splat, const WriteSettings& settings,
                          const RunSettings& run) {
  return InRun<void>(run, [&] { return WriteCloud(path, ToCloud(splat), ToOptions(settings)); });
}

Expected<std::vector<std::byte>> WriteSplatBytes(const SplatView& splat, std::string_view format,
                                                 const WriteSettings& settings, const RunSettings& run) {
  return InRun<std::vector<std::byte>>(run,
                                       [&] { return WriteCloudBytes(ToCloud(splat), format, ToOptions(settings)); });
}

}  // namespace anchorsplat
