#pragma once

#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>

namespace anchorsplat {

// For tests: all that a file holds, read past what io/ records and checks. A file that is not there ends the test.
inline std::string FileBytes(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw std::runtime_error(path.string() + ": cannot be opened by a test");
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace anchorsplat
