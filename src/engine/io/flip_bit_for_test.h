#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace anchorsplat {

// For tests: flips one bit of the byte `from_end` bytes before the end, as a bad disk does. A second call restores it.
inline void FlipBit(const std::filesystem::path& path, int from_end) {
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  file.seekg(-from_end, std::ios::end);
  const int byte = file.get();
  file.seekp(-from_end, std::ios::end);
  file.put(static_cast<char>(byte ^ 16));
  ASSERT_TRUE(file.good()) << path;
}

}  // namespace anchorsplat
