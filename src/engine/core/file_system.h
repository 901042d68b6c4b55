#pragma once

#include <filesystem>
#include <system_error>

namespace anchorsplat {

// std::filesystem queries that never throw: an overlong name, a cycle of links or an unreadable folder counts as absent
// here and becomes an error message when the file is opened. All other code passes an error code to std::filesystem
// (`make lint` checks).

// Whether anything, a folder, or a regular file exists at the path; links are followed.
inline bool Exists(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::exists(path, ignored);
}

inline bool IsFolder(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::is_directory(path, ignored);
}

inline bool IsFile(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::is_regular_file(path, ignored);
}

// Absolute path without links, "." and ".."; unchanged if the system cannot resolve it.
inline std::filesystem::path RealPath(const std::filesystem::path& path) {
  std::error_code failed;
  std::filesystem::path real = std::filesystem::weakly_canonical(path, failed);
  return failed ? path : real;
}

// Absolute path without "." and ".."; links stay.
inline std::filesystem::path AbsolutePath(const std::filesystem::path& path) {
  std::error_code failed;
  const std::filesystem::path absolute = std::filesystem::absolute(path, failed);
  return (failed ? path : absolute).lexically_normal();
}

}  // namespace anchorsplat
