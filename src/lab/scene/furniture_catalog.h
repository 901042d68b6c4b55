#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/result.h"
#include "io/zip_archive.h"
#include "scene/mesh_import.h"

namespace anchorsplat {

// One object of a catalogue.
struct CatalogEntry {
  int64_t number = 0;  // as in "name#12"
  std::string model;   // member of the archive, without a slash at its beginning
  std::string key;     // what addresses it: the model's file name without ending, "barrel"
  MeshOrigin origin;
  std::array<float, 9> rotation{};  // row-major, to be applied to the model's points; identity unless the entry has one
};

// A furniture library of Sweet Home 3D (.sh3f): a ZIP archive of models, mostly OBJ, with a properties file that lists
// them. Only the library's own language is read.
//
// An object's licence is that of the licence file beside its model (a name with "licen" in it) where that names one
// (licence.h), else what the properties file says in its property `license` or in the comment at its beginning.
class FurnitureCatalog {
 public:
  // Errors: kNotFound, kIo; kBadFile: no ZIP archive, no list of furniture in it, more than `limits` allow.
  static Result<FurnitureCatalog> Open(const std::filesystem::path& path, const MeshLimits& limits = {});

  const std::string& name() const { return name_; }  // "Blend Swap CC-0"
  const std::vector<CatalogEntry>& entries() const { return entries_; }

  // By key; where several entries share one, by "#number" or by the member's whole name. nullptr: none.
  const CatalogEntry* Find(const std::string& key) const;

  // The object as the catalogue shows it: rotated as the entry says, in the model's own unit. Errors as ImportMesh.
  Result<ImportedMesh> Read(const CatalogEntry& entry, const MeshReadOptions& options = {}) const;

 private:
  FurnitureCatalog() = default;
  void ReadEntries(const struct JavaProperties& properties);
  void FindLicences(const struct JavaProperties& properties);

  std::string path_;
  std::string name_;
  std::shared_ptr<const ZipReader> archive_;
  std::vector<CatalogEntry> entries_;
};

}  // namespace anchorsplat
