#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/result.h"

namespace anchorsplat {

// Two views of the same thing: indices into the two lists they were found in.
struct ViewPair {
  std::string name;  // without folder and extension
  size_t a = 0;
  size_t b = 0;
};

// Pairs views (file paths or camera names) by name without folder and extension; order of the first list.
// kBadArgument, listing them: names that occur twice in one list, names without a partner, an empty list.
Result<std::vector<ViewPair>> MatchViews(std::span<const std::string> a, std::span<const std::string> b);

// The PNG and JPEG files of a folder (by extension, not of folders inside it), sorted by name.
// Errors: kNotFound (no folder, none in it), kIo.
Result<std::vector<std::filesystem::path>> ListPictures(const std::filesystem::path& folder);

}  // namespace anchorsplat
