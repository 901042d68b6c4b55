#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"
#include "images/webp_image.h"
#include "io/input_file.h"
#include "io/json_file.h"
#include "io/zip_archive.h"

namespace anchorsplat {

// Folder of the only meta.json in an archive: "" or a folder name with its slash, as in a zipped folder. None if there
// is none, or several in folders.
std::optional<std::string> FolderOfSog(const std::vector<std::string>& members);

// Members of a SOG: in an archive, or beside meta.json. Must not outlive the file.
class SogMembers {
 public:
  static Result<SogMembers> Of(const InputFile& file);

  Result<std::string> Meta(const InputFile& file) const;
  bool is_archive() const { return archive_.has_value(); }
  // Bytes of a file in the folder; 0 if it does not exist.
  uint64_t SizeBeside(const std::string& name) const;
  std::string meta_name() const { return archive_ ? name_ + ": meta.json" : name_; }

  // Decodes the image `name`.
  Result<ByteImage> Picture(const JsonValue& name, int64_t min_pixels, int64_t max_pixels) const;

 private:
  std::string name_;
  std::optional<ZipReader> archive_;
  std::string folder_in_archive_;
  const InputFile* file_ = nullptr;  // meta.json itself,
  std::filesystem::path folder_;     // and its folder
};

// Members, with meta.json parsed.
struct OpenedSog {
  SogMembers members;
  JsonFile json;
};
Result<OpenedSog> OpenSog(const InputFile& file);

}  // namespace anchorsplat
