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

// Where the one meta.json of an archive lies: "" or a folder with its slash, as of a folder that somebody has packed.
// Nothing where there is none, or several in folders.
std::optional<std::string> FolderOfSog(const std::vector<std::string>& members);

// Where the members are: in an archive, or beside meta.json. Not longer there than the file.
class SogMembers {
 public:
  static Result<SogMembers> Of(const InputFile& file);

  Result<std::string> Meta(const InputFile& file) const;
  bool is_archive() const { return archive_.has_value(); }
  // Bytes of a file of the folder; 0 where it is none.
  uint64_t SizeBeside(const std::string& name) const;
  std::string meta_name() const { return archive_ ? name_ + ": meta.json" : name_; }

  // The picture called `name`.
  Result<ByteImage> Picture(const JsonValue& name, int64_t min_pixels, int64_t max_pixels) const;

 private:
  std::string name_;
  std::optional<ZipReader> archive_;
  std::string folder_in_archive_;
  const InputFile* file_ = nullptr;  // meta.json itself, and
  std::filesystem::path folder_;     // where it lies
};

// The members, with meta.json parsed.
struct OpenedSog {
  SogMembers members;
  JsonFile json;
};
Result<OpenedSog> OpenSog(const InputFile& file);

}  // namespace anchorsplat
