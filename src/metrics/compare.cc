#include "metrics/compare.h"

#include <algorithm>
#include <map>
#include <system_error>
#include <utility>

#include "cameras/view_labels.h"
#include "core/file_system.h"
#include "core/text.h"
#include "images/picture_names.h"

namespace anchorsplat {

namespace {

Error Bad(std::string sentence) { return Error{ErrorCode::kBadArgument, std::move(sentence)}; }

// The last `count` parts of a view's name, or all.
std::string End(const std::vector<std::string>& parts, size_t count) {
  std::string end;
  for (size_t k = parts.size() - std::min(count, parts.size()); k < parts.size(); ++k) {
    end += (end.empty() ? "" : "/") + parts[k];
  }
  return end;
}

// Indices by name; names that occur again go to `repeated`, once each.
std::map<std::string, size_t> IndexByEnd(const std::vector<std::vector<std::string>>& views, size_t count,
                                         std::vector<std::string>& repeated) {
  std::map<std::string, size_t> index;
  for (size_t i = 0; i < views.size(); ++i) {
    const std::string name = End(views[i], count);
    if (!index.emplace(name, i).second && std::ranges::find(repeated, name) == repeated.end()) repeated.push_back(name);
  }
  return index;
}

Status AddPictures(const std::filesystem::path& folder, int depth, std::vector<std::filesystem::path>& pictures) {
  std::error_code code;
  std::vector<std::filesystem::path> inner;
  const size_t before = pictures.size();
  for (std::filesystem::directory_iterator it(folder, code), end; !code && it != end; it.increment(code)) {
    if (HasPictureExtension(it->path()) && IsFile(it->path())) {
      pictures.push_back(it->path());
    } else if (!it->path().filename().string().starts_with('.') && IsFolder(it->path())) {
      inner.push_back(it->path());
    }
  }
  if (code) return Error{ErrorCode::kIo, Cat(folder.string(), ": ", code.message())};
  if (pictures.size() > before || depth == 0) return {};
  for (const auto& next : inner) ANCHORSPLAT_RETURN_IF_ERROR(AddPictures(next, depth - 1, pictures));
  return {};
}

}  // namespace

std::string FirstFew(std::span<const std::string> names) {
  constexpr size_t kShown = 10;
  std::string list;
  for (size_t i = 0; i < std::min(names.size(), kShown); ++i) list += (i == 0 ? "" : ", ") + Printable(names[i]);
  if (names.size() > kShown) list += Cat(" and ", names.size() - kShown, " more");
  return list;
}

Result<ViewPairs> MatchViews(std::span<const std::string> a, std::span<const std::string> b) {
  if (a.empty() || b.empty()) return Bad("there are no views to compare");
  std::vector<std::vector<std::string>> parts_a, parts_b;
  size_t longest = 1;
  for (const auto& [names, parts] : {std::pair(a, &parts_a), std::pair(b, &parts_b)}) {
    for (const std::string& name : names) {
      parts->push_back(ViewParts(name));
      longest = std::max(longest, parts->back().size());
    }
  }
  std::map<std::string, size_t> index_a, index_b;
  std::vector<std::string> repeated;
  for (size_t count = 1; count == 1 || (!repeated.empty() && count <= longest); ++count) {
    repeated.clear();
    index_a = IndexByEnd(parts_a, count, repeated);
    index_b = IndexByEnd(parts_b, count, repeated);
  }
  if (!repeated.empty()) {
    return Bad(
        Cat("views are matched by name without extension, and these occur more than once: ", FirstFew(repeated)));
  }
  ViewPairs out;
  for (const auto& [name, i] : index_a) {
    const auto partner = index_b.find(name);
    if (partner == index_b.end()) {
      out.only_a.push_back(name);
    } else {
      out.pairs.push_back({name, i, partner->second});
    }
  }
  for (const auto& [name, i] : index_b) {
    if (!index_a.contains(name)) out.only_b.push_back(name);
  }
  std::ranges::sort(out.pairs, {}, &ViewPair::a);
  return out;
}

Result<std::vector<std::filesystem::path>> ListPictures(const std::filesystem::path& folder) {
  if (!IsFolder(folder)) return Error{ErrorCode::kNotFound, Cat(folder.string(), ": no such folder")};
  constexpr int kDeepest = 4;
  std::vector<std::filesystem::path> pictures;
  ANCHORSPLAT_RETURN_IF_ERROR(AddPictures(folder, kDeepest, pictures));
  if (pictures.empty()) {
    return Error{ErrorCode::kNotFound, Cat(folder.string(), ": no ", kPictureKinds, " in this folder")};
  }
  std::ranges::sort(pictures);
  return pictures;
}

}  // namespace anchorsplat
