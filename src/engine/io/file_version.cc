#include "io/file_version.h"

#include <sys/stat.h>

namespace anchorsplat {

std::optional<FileVersion> VersionOf(const std::filesystem::path& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) return std::nullopt;
  return FileVersion{.device = static_cast<uint64_t>(status.st_dev),
                     .inode = static_cast<uint64_t>(status.st_ino),
                     .size = static_cast<uint64_t>(status.st_size),
                     .changed_s = static_cast<int64_t>(status.st_mtim.tv_sec),
                     .changed_ns = static_cast<int64_t>(status.st_mtim.tv_nsec)};
}

}  // namespace anchorsplat
