#pragma once

#include <filesystem>
#include <system_error>

namespace anchorsplat {

// What std::filesystem knows about a name, without its exceptions: a name that is too long, links that lead in a circle
// and folders that may not be looked into are answers here, and errors with a sentence where the file is then opened.
// Its functions are called elsewhere only with an error code (`make lint` looks).

// Whether there is something under this name, a folder, a regular file; links are followed.
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

// Absolute, without links, "." and ".."; the path as it is where the system cannot say.
inline std::filesystem::path RealPath(const std::filesystem::path& path) {
  std::error_code failed;
  std::filesystem::path real = std::filesystem::weakly_canonical(path, failed);
  return failed ? path : real;
}

// Absolute, without "." and "..", links as they are.
inline std::filesystem::path AbsolutePath(const std::filesystem::path& path) {
  std::error_code failed;
  const std::filesystem::path absolute = std::filesystem::absolute(path, failed);
  return (failed ? path : absolute).lexically_normal();
}

}  // namespace anchorsplat
