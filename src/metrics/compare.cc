#include "metrics/compare.h"

#include <algorithm>
#include <cctype>
#include <map>
#include <system_error>

#include "cameras/camera_checks.h"
#include "core/file_system.h"
#include "core/text.h"
#include "images/image_io.h"

namespace anchorsplat {

namespace {

// "001, 002 and 15 more": enough to see what went wrong.
std::string Listed(const std::vector<std::string>& names) {
  constexpr size_t kShown = 10;
  std::string list;
  for (size_t i = 0; i < std::min(names.size(), kShown); ++i) list += (i == 0 ? "" : ", ") + names[i];
  if (names.size() > kShown) list += Cat(" and ", names.size() - kShown, " more");
  return list;
}

Error Bad(std::string sentence) { return Error{ErrorCode::kBadArgument, std::move(sentence)}; }

// Index by name; names that occur again go to `repeated`, once each.
std::map<std::string, size_t> IndexByName(std::span<const std::string> views, std::vector<std::string>& repeated) {
  std::map<std::string, size_t> index;
  for (size_t i = 0; i < views.size(); ++i) {
    const std::string name = std::filesystem::path(ViewName(views[i])).filename().string();
    if (!index.emplace(name, i).second && std::find(repeated.begin(), repeated.end(), name) == repeated.end()) {
      repeated.push_back(name);
    }
  }
  return index;
}

}  // namespace

Result<std::vector<ViewPair>> MatchViews(std::span<const std::string> a, std::span<const std::string> b) {
  if (a.empty() || b.empty()) return Bad("there are no views to compare");
  std::vector<std::string> repeated;
  const auto index_a = IndexByName(a, repeated), index_b = IndexByName(b, repeated);
  if (!repeated.empty()) {
    return Bad(Cat("views are matched by name without folder and extension, and these occur more than once: ",
                   Listed(repeated)));
  }
  std::vector<std::string> only_a, only_b;
  std::vector<ViewPair> pairs;
  for (const auto& [name, i] : index_a) {
    const auto partner = index_b.find(name);
    if (partner == index_b.end()) {
      only_a.push_back(name);
    } else {
      pairs.push_back({name, i, partner->second});
    }
  }
  for (const auto& [name, i] : index_b) {
    if (!index_a.contains(name)) only_b.push_back(name);
  }
  if (!only_a.empty() || !only_b.empty()) {
    std::string sentence = "views without a partner:";
    if (!only_a.empty()) sentence += Cat(" only in the first set ", Listed(only_a));
    if (!only_b.empty()) sentence += Cat(only_a.empty() ? "" : ";", " only in the second set ", Listed(only_b));
    return Bad(std::move(sentence));
  }
  std::sort(pairs.begin(), pairs.end(), [](const ViewPair& x, const ViewPair& y) { return x.a < y.a; });
  return pairs;
}

Result<std::vector<std::filesystem::path>> ListPictures(const std::filesystem::path& folder) {
  std::error_code code;
  if (!IsFolder(folder)) {
    return Error{ErrorCode::kNotFound, Cat(folder.string(), ": no such folder")};
  }
  std::vector<std::filesystem::path> pictures;
  for (std::filesystem::directory_iterator it(folder, code), end; !code && it != end; it.increment(code)) {
    std::string extension = it->path().extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    std::error_code ignored;
    const bool picture = extension == ".png" || extension == ".jpg" || extension == ".jpeg";
    if (picture && it->is_regular_file(ignored)) pictures.push_back(it->path());
  }
  if (code) return Error{ErrorCode::kIo, Cat(folder.string(), ": ", code.message())};
  if (pictures.empty()) return Error{ErrorCode::kNotFound, Cat(folder.string(), ": no PNG or JPEG in this folder")};
  std::sort(pictures.begin(), pictures.end());
  return pictures;
}

}  // namespace anchorsplat
