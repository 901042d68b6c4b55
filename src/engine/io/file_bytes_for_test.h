#pragma once

#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>

namespace anchorsplat {

// For tests: the contents of a file, bypassing the checks and records of io/. Throws if it cannot be opened.
inline std::string FileBytes(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw std::runtime_error(path.string() + ": cannot be opened by a test");
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace anchorsplat
