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

// An object of a catalogue.
struct CatalogEntry {
  int64_t number = 0;  // as in "name#12"
  std::string model;   // archive member, without leading slash
  std::string key;     // address: the model's file name without extension, "barrel"
  MeshOrigin origin;
  std::array<float, 9> rotation{};  // row-major, to apply to the model's points; identity if the entry has none
};

// A furniture library of Sweet Home 3D (.sh3f): a ZIP archive of models, mostly OBJ, and a properties file that lists
// them. Only the library's own language is read.
//
// An object's licence comes from the licence file beside its model (a name with "licen" in it) if that names one
// (licence.h), else from the properties file: the property `license` or the initial comment.
class FurnitureCatalog {
 public:
  // Errors: kNotFound, kIo; kBadFile: no ZIP archive, no furniture list, or limits exceeded.
  static Result<FurnitureCatalog> Open(const std::filesystem::path& path, const MeshLimits& limits = {});

  const std::string& name() const { return name_; }  // "Blend Swap CC-0"
  const std::vector<CatalogEntry>& entries() const { return entries_; }

  // By key; if several entries share it, by "#number" or the member's full name. nullptr: none.
  const CatalogEntry* Find(const std::string& key) const;

  // The object as the catalogue shows it: rotated, in the model's own unit. Errors: those of ImportMesh.
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
