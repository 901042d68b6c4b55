#include "cameras/picture_folder.h"

#include <algorithm>
#include <system_error>
#include <utility>

#include "core/ascii_lower_case.h"
#include "core/decomposed.h"
#include "core/file_system.h"
#include "core/text.h"
#include "images/picture_names.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

// How well the image type of `name` matches that of `wanted`; less is better.
int Farness(const fs::path& wanted, const fs::path& name) {
  const auto kind = [](const fs::path& path) {
    const std::string extension = AsciiLowerCase(path.extension().string());
    return extension == ".jpeg" ? ".jpg" : extension == ".tiff" ? ".tif" : extension;
  };
  if (!HasPictureExtension(name)) return 3;  // found, so that reading it reports the type
  return kind(name) == (HasAnyPictureExtension(wanted) ? kind(wanted) : ".png") ? 1 : 2;
}

// Whether a name marks data that accompanies a photograph, such as r_0_depth_0001.png of NeRF-synthetic.
bool GoesWithAnother(const std::string& name) {
  const std::string stem = PictureStem(name);
  for (const char* kind : {"_depth", "_normal", "_mask", "_seg", "_alpha"}) {
    if (stem.find(kind) != std::string::npos) return true;
  }
  return false;
}

}  // namespace

std::string NameKey(const std::string& name) { return AsciiLowerCase(Decomposed(name)); }

std::string PictureStem(const std::string& name) {
  const fs::path path(name);
  return NameKey(HasAnyPictureExtension(path) ? path.stem().string() : name);
}

PictureFolder::PictureFolder(fs::path folder) : path_(std::move(folder)) {
  std::error_code code;
  for (fs::directory_iterator it(path_.empty() ? "." : path_, code), end; !code && it != end; it.increment(code)) {
    const std::string name = it->path().filename().string();
    if (name.starts_with('.') || !IsFile(it->path())) continue;
    by_name_[NameKey(name)].push_back(name);
    if (HasAnyPictureExtension(name)) by_stem_[PictureStem(name)].push_back(name);
  }
  for (auto* index : {&by_name_, &by_stem_}) {
    for (auto& [key, names] : *index) std::ranges::sort(names);
  }
}

Result<std::string> PictureFolder::Find(const std::string& name) const {
  const auto ambiguous = [&](const std::string& one, const std::string& other) {
    return Error{ErrorCode::kBadArgument, Cat("\"", Printable(name), "\" matches both ", (path_ / one).string(),
                                              " and ", (path_ / other).string(), "; rename one of them")};
  };
  if (const auto found = by_name_.find(NameKey(name)); found != by_name_.end()) {
    const auto& names = found->second;
    if (std::ranges::find(names, name) != names.end()) return name;
    if (names.size() > 1) return ambiguous(names[0], names[1]);
    return names[0];
  }
  const auto found = by_stem_.find(PictureStem(name));
  if (found == by_stem_.end()) return std::string();
  // Equal letter case counts more than equal image type.
  const std::string stem = HasAnyPictureExtension(name) ? fs::path(name).stem().string() : name;
  const auto farness = [&](const std::string& other) {
    return std::pair(fs::path(other).stem() != stem, Farness(name, other));
  };
  std::vector<std::string> nearest;
  for (const std::string& other : found->second) {
    if (!nearest.empty() && farness(other) > farness(nearest[0])) continue;
    if (!nearest.empty() && farness(other) < farness(nearest[0])) nearest.clear();
    nearest.push_back(other);
  }
  if (nearest.size() > 1) return ambiguous(nearest[0], nearest[1]);
  return nearest[0];
}

std::vector<std::string> PictureFolder::Photographs() const {
  std::vector<std::string> photographs;
  for (const auto& [stem, names] : by_stem_) {
    for (const std::string& name : names) {
      if (HasPictureExtension(name) && !GoesWithAnother(name)) photographs.push_back(name);
    }
  }
  std::ranges::sort(photographs);
  return photographs;
}

}  // namespace anchorsplat
