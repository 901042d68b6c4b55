#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

namespace anchorsplat {

// Identifies one state of one file. A replaced file or changed contents give another version, within the file system's
// time resolution.
struct FileVersion {
  uint64_t device = 0, inode = 0;
  uint64_t size = 0;      // bytes
  int64_t changed_s = 0;  // last change of contents, seconds since 1970
  int64_t changed_ns = 0;

  bool operator==(const FileVersion&) const = default;
};

// None if there is no regular file.
std::optional<FileVersion> VersionOf(const std::filesystem::path& path);

}  // namespace anchorsplat
