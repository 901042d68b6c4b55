#include "cameras/picture_search.h"

#include <algorithm>
#include <cctype>
#include <map>
#include <optional>
#include <set>
#include <system_error>
#include <tuple>
#include <utility>

#include "cameras/camera_checks.h"
#include "cameras/picture_folder.h"
#include "core/ascii_lower_case.h"
#include "core/file_system.h"
#include "core/log.h"
#include "core/text.h"
#include "images/rendering.h"
#include "io/input_record.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;
using Parts = std::vector<std::string>;

// Limits of the search: images are a few folders deep, and a home folder must not take forever.
constexpr int kDeepest = 5;
constexpr size_t kMostEntries = 200'000;
constexpr int kUsualRank = 20;  // rank of the usual folders (RankOf)

bool IsAbsoluteSomewhere(const std::string& path) {
  return path.starts_with('/') ||
         (path.size() > 1 && path[1] == ':' && std::isalpha(static_cast<unsigned char>(path[0])) != 0);
}

// Converts to '/' and removes URL scheme and drive.
std::string WithSlashes(std::string path) {
  std::ranges::replace(path, '\\', '/');
  if (path.starts_with("file://")) path.erase(0, 7);
  if (path.size() > 2 && path[0] == '/' && path[2] == ':') path.erase(0, 1);
  return path;
}

std::string PercentDecoded(const std::string& text) {
  const auto digit = [&](size_t i) {
    const char c = text[i];
    return c >= '0' && c <= '9'   ? c - '0'
           : c >= 'A' && c <= 'F' ? c - 'A' + 10
           : c >= 'a' && c <= 'f' ? c - 'a' + 10
                                  : -1;
  };
  std::string decoded;
  for (size_t i = 0; i < text.size(); ++i) {
    const bool code = text[i] == '%' && i + 2 < text.size() && digit(i + 1) >= 0 && digit(i + 2) >= 0;
    const int value = code ? 16 * digit(i + 1) + digit(i + 2) : 0;
    decoded += value > 0 ? static_cast<char>(value) : text[i];
    if (value > 0) i += 2;
  }
  return decoded;
}

thread_local AmbiguousPictures* open_ambiguous = nullptr;

// A path of the file, split.
struct Named {
  explicit Named(const std::string& text) : path(WithSlashes(text)), absolute(IsAbsoluteSomewhere(path)) {
    const size_t slash = path.rfind('/');
    folder = slash == std::string::npos ? "" : path.substr(0, slash + 1);
    file = slash == std::string::npos ? path : path.substr(slash + 1);
    for (const fs::path& part : fs::path(folder)) {
      const std::string name = part.string();
      if (name.empty() || name == "." || name == "/" || (absolute && name.ends_with(':'))) continue;
      if (name != "..") {
        parts.push_back(name);
      } else if (!parts.empty()) {
        parts.pop_back();
      }
    }
  }
  std::string path;
  bool absolute;
  std::string folder, file;
  Parts parts;  // of the folder
};

// Number of path components in the common suffix, ignoring case.
size_t CommonEnd(const Parts& a, const Parts& b) {
  size_t n = 0;
  while (n < a.size() && n < b.size() && NameKey(a[a.size() - 1 - n]) == NameKey(b[b.size() - 1 - n])) ++n;
  return n;
}

Parts PartsOf(const fs::path& folder) {
  Parts parts;
  for (const fs::path& part : folder) {
    if (const std::string name = part.string(); !name.empty() && name != "/" && name != ".") parts.push_back(name);
  }
  return parts;
}

// Whether the first word of a folder name means no photographs: masks, depth_maps, normal-8, renders
// (ours_30000/renders beside gt).
bool IsOfOtherThings(const std::string& name) {
  std::string word =
      name.substr(0, std::ranges::find_if_not(name, [](unsigned char c) { return std::isalpha(c); }) - name.begin());
  if (word.ends_with('s')) word.pop_back();
  for (const char* other :
       {"mask", "depth", "depthmap", "normal", "normalmap", "seg", "segment", "segmentation", "semantic", "label",
        "flow", "thumb", "thumbnail", "preview", "render", "gt", "our", "eval"}) {
    if (word == other) return true;
  }
  return false;
}

// Rank of a folder for photographs by its name and those above it; less is likelier, none: not photographs.
std::optional<int> RankOf(const Parts& below, const PicturePlaces& places) {
  if (below.empty()) return 30;  // the project folder
  int best = 50;
  for (const std::string& part : below) {
    const std::string name = AsciiLowerCase(part);
    if (!places.masks && IsOfOtherThings(name)) return std::nullopt;
    // images_4 of nerfstudio and 3DGS: downscaled by 4.
    const size_t bar = name.rfind('_');
    const bool reduced = bar != std::string::npos && bar + 1 < name.size() && name.size() < bar + 5 &&
                         std::all_of(name.begin() + static_cast<ptrdiff_t>(bar) + 1, name.end(),
                                     [](unsigned char c) { return std::isdigit(c) != 0; });
    if (reduced && name.starts_with("image")) return 1000 + std::stoi(name.substr(bar + 1));
    if (name == "input") best = std::min(best, places.originals ? 0 : 11);
    if (name == "images" || name == "image") best = std::min(best, 10);
    for (const char* usual : {"rgb", "rgbs", "color", "colour", "photos", "pictures", "frames"}) {
      if (name == usual) best = std::min(best, kUsualRank);
    }
  }
  return best;
}

class Search {
 public:
  Search(const PicturePlaces& places, std::span<const std::string> names)
      : places_(places), found_(names.size()), open_(names.size(), true) {
    for (const std::string& name : names) {
      raw_.push_back(name);
      named_.emplace_back(name);
    }
  }

  std::vector<FoundPicture> Run() {
    for (size_t i = 0; i < raw_.size(); ++i) TakeLiterally(i);
    SearchFolders();
    for (size_t i = 0; i < raw_.size(); ++i) {
      const std::string decoded = PercentDecoded(raw_[i]);
      open_[i] = IsOpen(i) && decoded != raw_[i];
      if (!open_[i]) continue;
      const bool settled = settled_.contains(named_[i].folder);
      named_[i] = Named(decoded);
      if (settled) settled_.insert(named_[i].folder);
    }
    SearchFolders();
    NameViews();
    if (places_.complete) TellOfOthers();
    for (size_t i = 0; i < raw_.size(); ++i) {
      if (!found_[i].file.empty()) {
        // Images count as inputs, whoever opens them; our renderings may be rendered again.
        if (!IsOwnRendering(found_[i].file)) RecordInput(found_[i].file);
      } else {
        const fs::path& first = places_.folders.empty() ? places_.project : places_.folders[0];
        const bool drive = named_[i].absolute && !named_[i].path.starts_with('/');
        found_[i].file = AbsolutePath(first / (drive ? named_[i].file : named_[i].path));
      }
    }
    return std::move(found_);
  }

 private:
  // Names may contain '\' or '%' themselves.
  void TakeLiterally(size_t i) {
    if (raw_[i].find_first_of("\\%") == std::string::npos) return;
    for (const fs::path& base : places_.folders) {
      const fs::path file = (base / raw_[i]).lexically_normal();
      if (!IsFile(file)) continue;
      Take(i, file.parent_path(), file.filename().string(), 0);
      return;
    }
  }

  void Take(size_t i, const fs::path& folder, const std::string& file, size_t levels) {
    found_[i].file = folder / file;
    used_[folder].insert(file);
    fs::path relative = file, above = folder;
    std::vector<std::pair<fs::path, std::string>> places = {{above, file}};
    for (size_t level = 0; level < levels && above.has_filename(); ++level) {
      relative = above.filename() / relative;
      above = above.parent_path();
      places.emplace_back(above, relative.string());
    }
    for (; !places.empty() && found_[i].mask.empty(); places.pop_back()) {
      found_[i].mask = FindMask({&places.back().first, 1}, places.back().second);
    }
  }

  const PictureFolder& Folder(const fs::path& path) {
    const auto known = folders_.find(path);
    return known != folders_.end() ? known->second : folders_.emplace(path, PictureFolder(path)).first->second;
  }

  bool IsOpen(size_t i) const { return found_[i].file.empty() && found_[i].ambiguity.empty(); }

  // Missing images, grouped by the folder in the file.
  std::map<std::string, std::vector<size_t>> Groups() const {
    std::map<std::string, std::vector<size_t>> groups;
    for (size_t i = 0; i < named_.size(); ++i) {
      if (open_[i] && IsOpen(i) && !named_[i].file.empty()) groups[named_[i].folder].push_back(i);
    }
    return groups;
  }

  void SearchFolders() {
    for (const auto& [folder, group] : Groups()) {
      for (const fs::path& base : places_.folders) {
        // "images/" of a project is its folder "images", however it is reached.
        fs::path place = (base / folder).lexically_normal();
        if (!place.has_filename() && place.has_parent_path() && place != place.root_path()) place = place.parent_path();
        if (TakeFrom(Folder(place), group, named_[group[0]].parts.size()) > 0) settled_.insert(folder);
      }
      if (!settled_.contains(folder) && !places_.project.empty()) SearchProject(group);
    }
  }

  // Number of the group's images in this folder; takes those not yet found.
  size_t TakeFrom(const PictureFolder& folder, const std::vector<size_t>& group, size_t levels) {
    size_t count = 0;
    if (folder.empty()) return count;
    for (const size_t i : group) {
      const Result<std::string> file = folder.Find(named_[i].file);
      if (file.ok() && file->empty()) continue;
      ++count;
      if (!IsOpen(i)) continue;
      if (file.ok()) {
        Take(i, folder.path(), *file, levels);
      } else {
        found_[i].ambiguity = file.error().message;
      }
    }
    return count;
  }

  // Whether the group's first image in a folder is our rendering.
  bool IsRendered(const PictureFolder& folder, const std::vector<size_t>& group) const {
    for (const size_t i : group) {
      const Result<std::string> file = folder.Find(named_[i].file);
      if (file.ok() && !file->empty()) return IsOwnRendering(folder.path() / *file);
    }
    return false;
  }

  void SearchProject(const std::vector<size_t>& group) {
    ListProject();
    const Parts project = PartsOf(AbsolutePath(places_.project));
    std::set<const PictureFolder*> candidates;
    for (const size_t i : group) {
      const auto has = by_stem_.find(PictureStem(named_[i].file));
      if (has != by_stem_.end()) candidates.insert(has->second.begin(), has->second.end());
    }
    // Sorted by path suffix, then folder name, as a set of pointers has no stable order.
    std::vector<std::tuple<ptrdiff_t, int, fs::path, const PictureFolder*>> ranked;
    for (const PictureFolder* folder : candidates) {
      const Parts all = PartsOf(AbsolutePath(folder->path()));
      const size_t common = CommonEnd(all, named_[group[0]].parts);
      const size_t own = std::min(project.size(), all.size());
      Parts below(all.begin() + static_cast<ptrdiff_t>(own), all.end());
      below.resize(below.size() - std::min(common, below.size()));  // the part given by the file is right
      const auto rank = common > 0 && below.empty() ? std::optional(0) : RankOf(below, places_);
      // Renderings in the usual folders may be training images; elsewhere they are results.
      if (rank > kUsualRank && IsRendered(*folder, group)) continue;
      if (rank) ranked.emplace_back(-static_cast<ptrdiff_t>(common), *rank, folder->path(), folder);
    }
    if (ranked.empty()) return;
    std::ranges::sort(ranked);
    if (ranked.size() > 1 && std::get<0>(ranked[0]) == std::get<0>(ranked[1]) &&
        std::get<1>(ranked[0]) == std::get<1>(ranked[1])) {
      const std::string ambiguity =
          Cat("the picture \"", Printable(raw_[group[0]]), "\" and others may be in ", std::get<2>(ranked[0]).string(),
              " or in ", std::get<2>(ranked[1]).string(), "; move one of these folders away");
      for (const size_t i : group) found_[i].ambiguity = ambiguity;
      return;
    }
    const auto& [common, rank, path, folder] = ranked[0];
    if (common == 0 && rank > kUsualRank && !told_) {
      told_ = true;
      LogInfo(Cat(Printable(raw_[group[0]]), " is not where the camera file says; found in ", path.string()));
    }
    TakeFrom(*folder, group, static_cast<size_t>(-common));
  }

  // All folders with images below the project, listed once; none if there are too many.
  void ListProject() {
    if (listed_) return;
    listed_ = true;
    std::set<fs::path> seen;  // links may form cycles
    size_t entries = 0;
    List(places_.project, kDeepest, seen, entries);
    if (entries > kMostEntries) below_.clear();
    for (const PictureFolder& folder : below_) {
      for (const auto& [stem, names] : folder.by_stem()) by_stem_[stem].push_back(&folder);
    }
  }

  void List(const fs::path& folder, int depth, std::set<fs::path>& seen, size_t& entries) {
    if (entries > kMostEntries || !seen.insert(RealPath(folder)).second) return;
    std::vector<fs::path> inner;
    std::error_code code;
    for (fs::directory_iterator it(folder.empty() ? "." : folder, code), end; !code && it != end; it.increment(code)) {
      if (++entries > kMostEntries) return;
      const std::string name = it->path().filename().string();
      if (!name.starts_with('.') && IsFolder(it->path())) inner.push_back(folder / name);
    }
    PictureFolder pictures(folder);
    if (!pictures.empty()) below_.push_back(std::move(pictures));
    std::ranges::sort(inner);
    for (const fs::path& next : inner) {
      if (depth > 0) List(next, depth - 1, seen, entries);
    }
  }

  // View names exclude another machine's folders.
  void NameViews() {
    std::optional<Parts> common;
    for (const Named& named : named_) {
      if (!named.absolute) continue;
      if (!common) common = named.parts;
      size_t n = 0;
      while (n < common->size() && n < named.parts.size() && (*common)[n] == named.parts[n]) ++n;
      common->resize(n);
    }
    for (size_t i = 0; i < named_.size(); ++i) {
      const Parts& parts = named_[i].parts;
      std::string name;
      for (size_t k = named_[i].absolute ? common->size() : 0; k < parts.size(); ++k) name += parts[k] + '/';
      found_[i].name = ViewName(name + named_[i].file);
    }
  }

  void TellOfOthers() {
    size_t all = 0, others = 0;
    for (const auto& [folder, files] : used_) {
      for (const std::string& name : Folder(folder).Photographs()) {
        ++all;
        others += files.contains(name) ? 0 : 1;
      }
    }
    if (others == 0) return;
    const fs::path where = used_.size() == 1 ? used_.begin()->first : places_.project;
    const std::string text =
        Cat(where.string(), ": ", others, " of ", all, " pictures have no camera and are not used");
    // A reconstruction may omit some images, but not most.
    if (2 * others >= all) {
      LogWarning(text);
    } else {
      LogInfo(text);
    }
  }

  const PicturePlaces& places_;
  std::vector<std::string> raw_;
  std::vector<Named> named_;
  std::vector<FoundPicture> found_;
  std::vector<bool> open_;         // images still to be found
  std::set<std::string> settled_;  // folders of the file that have been resolved: other names in them are missing
  std::map<fs::path, PictureFolder> folders_;
  std::map<fs::path, std::set<std::string>> used_;
  bool listed_ = false, told_ = false;
  std::vector<PictureFolder> below_;
  std::map<std::string, std::vector<const PictureFolder*>> by_stem_;
};

}  // namespace

std::vector<FoundPicture> FindPictures(const PicturePlaces& places, std::span<const std::string> names) {
  std::vector<FoundPicture> found = Search(places, names).Run();
  for (const FoundPicture& picture : found) {
    if (open_ambiguous != nullptr && open_ambiguous->first_.empty()) open_ambiguous->first_ = picture.ambiguity;
  }
  return found;
}

void FindPicturesOf(const PicturePlaces& places, std::span<Camera> cameras) {
  std::vector<std::string> names;
  for (const Camera& camera : cameras) names.push_back(camera.image.string());
  std::vector<FoundPicture> found = FindPictures(places, names);
  for (size_t i = 0; i < found.size(); ++i) {
    cameras[i].name = std::move(found[i].name);
    cameras[i].image = std::move(found[i].file);
    cameras[i].photograph.mask = std::move(found[i].mask);
  }
}

AmbiguousPictures::AmbiguousPictures() : outer_(open_ambiguous) { open_ambiguous = this; }

AmbiguousPictures::~AmbiguousPictures() { open_ambiguous = outer_; }

fs::path ProjectAbove(const fs::path& folder) {
  constexpr int kHighest = 4;
  fs::path place = folder.empty() ? "." : folder;
  fs::path full = AbsolutePath(place);
  if (!full.has_filename()) full = full.parent_path();
  for (int level = 0; level < kHighest; ++level) {
    const std::string name = AsciiLowerCase(full.filename().string());
    bool inner = !name.empty() && std::ranges::all_of(name, [](unsigned char c) { return std::isdigit(c) != 0; });
    for (const char* usual : {"sparse", "colmap", "distorted", "undistorted", "dense", "text", "txt", "bin", "model"}) {
      inner = inner || name.starts_with(usual);
    }
    if (!inner || !full.has_parent_path() || full == full.root_path()) break;
    full = full.parent_path();
    place = (place / "..").lexically_normal();
  }
  if (!place.has_filename() && place.has_parent_path() && place != place.root_path()) place = place.parent_path();
  return place;
}

}  // namespace anchorsplat
