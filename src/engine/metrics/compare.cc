#include "metrics/compare.h"

#include <algorithm>
#include <map>
#include <system_error>
#include <utility>

#include "cameras/view_labels.h"
#include "core/decomposed.h"
#include "core/file_system.h"
#include "core/text.h"
#include "images/picture_names.h"

namespace anchorsplat {

namespace {

Error Bad(std::string sentence) { return Error{ErrorCode::kBadArgument, std::move(sentence)}; }

// The last `count` components of a view's name, or all.
std::string End(const std::vector<std::string>& parts, size_t count) {
  std::string end;
  for (size_t k = parts.size() - std::min(count, parts.size()); k < parts.size(); ++k) {
    end += (end.empty() ? "" : "/") + parts[k];
  }
  return end;
}

// Indices by name, ignoring Unicode decomposition; duplicates are listed once in `repeated`.
std::map<std::string, size_t> IndexByEnd(const std::vector<std::vector<std::string>>& views, size_t count,
                                         std::vector<std::string>& repeated) {
  std::map<std::string, size_t> index;
  for (size_t i = 0; i < views.size(); ++i) {
    const std::string name = End(views[i], count);
    if (!index.emplace(Decomposed(name), i).second && std::ranges::find(repeated, name) == repeated.end())
      repeated.push_back(name);
  }
  return index;
}

using Parts = std::vector<std::string>;

// Number of common leading folders if the depth below them varies: names start after them. If all views are equally
// deep, the last common folder may be needed to tell the lists apart.
size_t CommonFolders(const std::vector<Parts>& views) {
  size_t common = views[0].size(), shortest = common, longest = common;
  for (const Parts& parts : views) {
    shortest = std::min(shortest, parts.size());
    longest = std::max(longest, parts.size());
    common = std::min(common, static_cast<size_t>(std::ranges::mismatch(views[0], parts).in1 - views[0].begin()));
  }
  return shortest < longest ? std::min(common, shortest - std::min<size_t>(shortest, 1)) : 0;
}

bool IsEndOf(std::span<const std::string> end, const Parts& parts) {
  return !end.empty() && end.size() <= parts.size() &&
         std::equal(end.begin(), end.end(), parts.end() - static_cast<ptrdiff_t>(end.size()));
}

// Pairs views whose whole name below the common folder is a suffix of exactly one other's: "2" and "images/2" beside
// "a/0" and "images/a/0".
std::vector<ViewPair> PairByWholeNames(const std::vector<Parts>& a, const std::vector<size_t>& left_a,
                                       const std::vector<Parts>& b, const std::vector<size_t>& left_b) {
  const size_t common_a = CommonFolders(a), common_b = CommonFolders(b);
  std::vector<ViewPair> pairs;
  std::map<size_t, int> times_a, times_b;
  for (const size_t i : left_a) {
    for (const size_t j : left_b) {
      if (!IsEndOf(std::span(a[i]).subspan(std::min(common_a, a[i].size())), b[j]) &&
          !IsEndOf(std::span(b[j]).subspan(std::min(common_b, b[j].size())), a[i])) {
        continue;
      }
      pairs.push_back({End(a[i], a[i].size() - std::min(common_a, a[i].size())), i, j});
      ++times_a[i];
      ++times_b[j];
    }
  }
  std::erase_if(pairs, [&](const ViewPair& pair) { return times_a[pair.a] > 1 || times_b[pair.b] > 1; });
  return pairs;
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
  size_t count = 0;  // components needed to be unique
  do {
    ++count;
    repeated.clear();
    index_a = IndexByEnd(parts_a, count, repeated);
    index_b = IndexByEnd(parts_b, count, repeated);
  } while (!repeated.empty() && count < longest);
  if (!repeated.empty()) {
    return Bad(
        Cat("views are matched by name without extension, and these occur more than once: ", FirstFew(repeated)));
  }
  ViewPairs out;
  std::vector<size_t> left_a, left_b;
  for (const auto& [name, i] : index_a) {
    const auto partner = index_b.find(name);
    if (partner == index_b.end()) {
      left_a.push_back(i);
    } else {
      out.pairs.push_back({End(parts_a[i], count), i, partner->second});
    }
  }
  for (const auto& [name, i] : index_b) {
    if (!index_a.contains(name)) left_b.push_back(i);
  }
  if (count > 1) {
    for (ViewPair& pair : PairByWholeNames(parts_a, left_a, parts_b, left_b)) {
      std::erase(left_a, pair.a);
      std::erase(left_b, pair.b);
      out.pairs.push_back(std::move(pair));
    }
  }
  for (const size_t i : left_a) out.only_a.push_back(End(parts_a[i], count));
  for (const size_t i : left_b) out.only_b.push_back(End(parts_b[i], count));
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
