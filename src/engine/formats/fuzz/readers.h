#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"

namespace anchorsplat {

// A reader under test. `read` returns its status, and aborts if accepted data is unsound.
struct FuzzReader {
  std::string name;
  std::vector<std::string> seeds;       // good files
  std::vector<std::string_view> words;  // words of the format's text, for mutations
  std::function<Status(const std::string& bytes)> read;
};

// All readers. Those that read by path use files in `folder`, which must exist.
std::vector<FuzzReader> FuzzReaders(const std::filesystem::path& folder);

}  // namespace anchorsplat
