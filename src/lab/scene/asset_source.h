#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "core/result.h"
#include "io/zip_archive.h"

namespace anchorsplat {

// Finds the files that a mesh file names: material library, pictures, buffers. Mesh files come from other people's
// machines, so names are read as meant: backslashes are slashes, the case may be wrong, %20 may be a space, and for
// "C:\models\wood.png" only wood.png is searched, beside the mesh. Names may lead to the folder above the mesh's
// ("../textures/wood.png"), but no further: a downloaded mesh must not reach the rest of the disk.
class AssetSource {
 public:
  virtual ~AssetSource() = default;

  // Reads the file that `name` means. kNotFound: there is none; kBadFile: longer than `max_bytes`, damaged or refused;
  // kIo.
  Result<std::string> Read(const std::string& name, uint64_t max_bytes) const;
  bool Has(const std::string& name) const { return !Resolve(name).empty(); }
  // Whether `name` is not searched because it leads further up than the folder above the mesh's.
  bool Refuses(const std::string& name) const;

 protected:
  // Actual name of a relative path with slashes, ignoring case; "" if there is none.
  virtual std::string Find(const std::string& relative) const = 0;
  virtual Result<std::string> ReadFound(const std::string& found, uint64_t max_bytes) const = 0;

 private:
  std::string Resolve(const std::string& name) const;
};

// Warning text for refused names.
inline constexpr const char* kRefusal = "not looked for: it leads out of the folder above the mesh's";

// Files in a folder and the one above. Folders, pipes and devices count as missing.
class FolderAssets : public AssetSource {
 public:
  explicit FolderAssets(std::filesystem::path folder) : folder_(std::move(folder)) {}

 protected:
  std::string Find(const std::string& relative) const override;
  Result<std::string> ReadFound(const std::string& found, uint64_t max_bytes) const override;

 private:
  std::filesystem::path folder_;
};

// Members of an archive, relative to a folder in it ("" for the top).
class ZipAssets : public AssetSource {
 public:
  ZipAssets(std::shared_ptr<const ZipReader> archive, std::string folder);

 protected:
  std::string Find(const std::string& relative) const override;
  Result<std::string> ReadFound(const std::string& found, uint64_t max_bytes) const override;

 private:
  std::shared_ptr<const ZipReader> archive_;
  std::string folder_;
  std::map<std::string, std::string> members_;  // lower-case name → actual name
};

}  // namespace anchorsplat
