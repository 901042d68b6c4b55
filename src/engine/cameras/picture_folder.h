#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/result.h"

namespace anchorsplat {

// Images of one folder, looked up by name regardless of letter case, Unicode decomposition (core/decomposed.h) and
// image type.
class PictureFolder {
 public:
  // Empty if the folder cannot be read.
  explicit PictureFolder(std::filesystem::path folder);

  const std::filesystem::path& path() const { return path_; }
  bool empty() const { return by_name_.empty(); }

  // The file name that `name` means: an exact match, else other letter case, else another image type (.png first if
  // `name` has no extension, as in NeRF's files). Empty: none. kBadArgument: two files match equally well; the message
  // names both.
  Result<std::string> Find(const std::string& name) const;

  // Its images by PictureStem.
  const std::map<std::string, std::vector<std::string>>& by_stem() const { return by_stem_; }

  // Names of photographs, sorted; excludes depth maps, normals and masks by their names.
  std::vector<std::string> Photographs() const;

 private:
  std::filesystem::path path_;
  std::map<std::string, std::vector<std::string>> by_name_;  // by NameKey, with extension
  std::map<std::string, std::vector<std::string>> by_stem_;
};

// Equal for names that differ only in letter case or Unicode decomposition.
std::string NameKey(const std::string& name);

// Key of by_stem() for an image name.
std::string PictureStem(const std::string& name);

}  // namespace anchorsplat
