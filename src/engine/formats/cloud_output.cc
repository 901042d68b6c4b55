#include "formats/cloud_output.h"

#include "formats/registry.h"
#include "io/atomic_file.h"

namespace anchorsplat {

namespace fs = std::filesystem;

std::vector<fs::path> FilesOfCloud(const fs::path& path, int sh_degree) {
  const SplatFormat* format = FormatOfExtension(path);
  std::vector<fs::path> files = {path};
  if (format == nullptr || format->written_beside == nullptr) return files;
  for (const fs::path& file : format->written_beside(path, sh_degree)) files.push_back(file);
  return files;
}

Status CheckCanWriteCloud(const fs::path& path, int sh_degree, const CloudWriteOptions& options) {
  if (options.memory != nullptr) return {};
  for (const fs::path& file : FilesOfCloud(path, sh_degree)) {
    ANCHORSPLAT_RETURN_IF_ERROR(CheckWritable(file, options.overwrite));
  }
  return {};
}

Status WriteCloudOrSaveBeside(const fs::path& path, const CloudView& cloud, const CloudWriteOptions& options,
                              const ExtraProperties& extras) {
  return WriteOrSaveBeside(path, options.overwrite, [&](const fs::path& name, bool overwrite) {
    CloudWriteOptions write = options;
    write.overwrite = overwrite;
    return WriteCloud(name, cloud, write, extras);
  });
}

}  // namespace anchorsplat
