#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/result.h"

namespace anchorsplat {

// Indices of a view in each of two lists.
struct ViewPair {
  std::string name;  // without extension, as short as is unique
  size_t a = 0;
  size_t b = 0;
};

struct ViewPairs {
  std::vector<ViewPair> pairs;              // order of the first list
  std::vector<std::string> only_a, only_b;  // views without a partner
};

// Pairs views (file paths or camera names) by the last path component if that is unique in both lists, else by as many
// as needed ("cam0/0000"); views with fewer components then match by all of theirs. kBadArgument, with the names:
// duplicates in one list, an empty list.
Result<ViewPairs> MatchViews(std::span<const std::string> a, std::span<const std::string> b);

// "001, 002 and 15 more", for messages.
std::string FirstFew(std::span<const std::string> names);

// Images in a folder (PNG, JPEG, WebP and TIFF, by extension), sorted by path; if there are none, those of its
// subfolders, at most four deep. Errors: kNotFound (no folder, no image), kIo.
Result<std::vector<std::filesystem::path>> ListPictures(const std::filesystem::path& folder);

}  // namespace anchorsplat
