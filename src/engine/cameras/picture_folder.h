#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/result.h"

namespace anchorsplat {

// The pictures of one folder, found by names that may differ in the case of letters, in how marks are on them
// (core/decomposed.h) and in the kind of picture.
class PictureFolder {
 public:
  // Of a folder that cannot be read there are none.
  explicit PictureFolder(std::filesystem::path folder);

  const std::filesystem::path& path() const { return path_; }
  bool empty() const { return by_name_.empty(); }

  // The file that `name` means, without the folder: the same name; else in other letters; else another kind of picture
  // (.png first where the name has none, as NeRF's files mean it). Empty: none.
  // kBadArgument: two files are as likely; the message names both.
  Result<std::string> Find(const std::string& name) const;

  // Its pictures by their names' keys, without the extension.
  const std::map<std::string, std::vector<std::string>>& by_stem() const { return by_stem_; }

  // The names of photographs, sorted: no depth maps, normals or masks by their names.
  std::vector<std::string> Photographs() const;

 private:
  std::filesystem::path path_;
  std::map<std::string, std::vector<std::string>> by_name_;  // of NameKey, with extension
  std::map<std::string, std::vector<std::string>> by_stem_;
};

// The same for names that nobody tells apart.
std::string NameKey(const std::string& name);

// The key of by_stem() for the name of a picture.
std::string PictureStem(const std::string& name);

}  // namespace anchorsplat
