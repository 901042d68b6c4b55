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
  std::string name;  // without extension, and as short as tells views apart
  size_t a = 0;
  size_t b = 0;
};

struct ViewPairs {
  std::vector<ViewPair> pairs;              // order of the first list
  std::vector<std::string> only_a, only_b;  // names of those without a partner
};

// Pairs views (file paths or camera names) by the last part of their names where that tells them apart in both lists,
// else by as many parts as do: "cam0/0000"; there, views with fewer parts by all of theirs. kBadArgument, listing them:
// names that occur twice in one list, an empty list.
Result<ViewPairs> MatchViews(std::span<const std::string> a, std::span<const std::string> b);

// "001, 002 and 15 more": enough to see what is meant.
std::string FirstFew(std::span<const std::string> names);

// The pictures of a folder (PNG, JPEG, WebP and TIFF, by extension), sorted by path; where there are none, those of the
// folders in it, at most four deep. Errors: kNotFound (no folder, none in it), kIo.
Result<std::vector<std::filesystem::path>> ListPictures(const std::filesystem::path& folder);

}  // namespace anchorsplat
