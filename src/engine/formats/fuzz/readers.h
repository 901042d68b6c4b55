#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"

namespace anchorsplat {

// One reader under test. `read` gives its status; what it accepts must be sound (it aborts otherwise).
struct FuzzReader {
  std::string name;
  std::vector<std::string> seeds;       // good files
  std::vector<std::string_view> words;  // of the format's text, to be put in wrong places
  std::function<Status(const std::string& bytes)> read;
};

// All readers of the room. Those that read by path find their input in `folder`, which must be there.
std::vector<FuzzReader> FuzzReaders(const std::filesystem::path& folder);

}  // namespace anchorsplat
