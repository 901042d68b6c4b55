#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "core/result.h"
#include "io/zip_archive.h"

namespace anchorsplat {

// Where a mesh file finds the files it names: its material library, its pictures, its buffers. Mesh files come from
// other people's machines, so names are taken as those people meant them: backslashes are slashes, letters may have
// the wrong case, %20 may stand for a space, and of "C:\models\wood.png" only wood.png is looked for, beside the mesh.
// Names may lead to the folder above the mesh's and what is in it ("../textures/wood.png"), no further: a mesh from the
// network has no business with the rest of the disk.
class AssetSource {
 public:
  virtual ~AssetSource() = default;

  // The bytes of what `name` means. kNotFound when there is nothing of that name, kBadFile when it is longer than
  // `max_bytes`, damaged or refused, kIo when the system refuses.
  Result<std::string> Read(const std::string& name, uint64_t max_bytes) const;
  bool Has(const std::string& name) const { return !Resolve(name).empty(); }
  // True when there is nothing because the name leads further up than the folder above the mesh's.
  bool Refuses(const std::string& name) const;

 protected:
  // What a relative path with slashes is called in this source, whatever the case of its letters; "" if nothing is.
  virtual std::string Find(const std::string& relative) const = 0;
  virtual Result<std::string> ReadFound(const std::string& found, uint64_t max_bytes) const = 0;

 private:
  std::string Resolve(const std::string& name) const;
};

// What a warning says of names that are refused.
inline constexpr const char* kRefusal = "not looked for: it leads out of the folder above the mesh's";

// Files in and around a folder ("../textures/wood.png" is followed). Folders, pipes and devices are nothing.
class FolderAssets : public AssetSource {
 public:
  explicit FolderAssets(std::filesystem::path folder) : folder_(std::move(folder)) {}

 protected:
  std::string Find(const std::string& relative) const override;
  Result<std::string> ReadFound(const std::string& found, uint64_t max_bytes) const override;

 private:
  std::filesystem::path folder_;
};

// Members of an archive, seen from a folder in it ("" for the top).
class ZipAssets : public AssetSource {
 public:
  ZipAssets(std::shared_ptr<const ZipReader> archive, std::string folder);

 protected:
  std::string Find(const std::string& relative) const override;
  Result<std::string> ReadFound(const std::string& found, uint64_t max_bytes) const override;

 private:
  std::shared_ptr<const ZipReader> archive_;
  std::string folder_;
  std::map<std::string, std::string> members_;  // in small letters → as it is
};

}  // namespace anchorsplat
