#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

namespace anchorsplat {

// One state of one file: another file under its name, or other bytes in it, are another one, as far as the file system
// notes the time of a change.
struct FileVersion {
  uint64_t device = 0, inode = 0;
  uint64_t size = 0;      // bytes
  int64_t changed_s = 0;  // when its bytes did last, seconds since 1970 …
  int64_t changed_ns = 0;

  bool operator==(const FileVersion&) const = default;
};

// Nothing where there is no regular file.
std::optional<FileVersion> VersionOf(const std::filesystem::path& path);

}  // namespace anchorsplat
