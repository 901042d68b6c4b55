#include "scene/furniture_catalog.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <sstream>
#include <utility>

#include "core/ascii_lower_case.h"
#include "core/text.h"
#include "io/file_bytes.h"
#include "scene/java_properties.h"
#include "scene/licence.h"

namespace anchorsplat {

namespace {

constexpr const char* kListName = "PluginFurnitureCatalog.properties";
constexpr uint64_t kLongestList = uint64_t{1} << 26;     // bytes
constexpr uint64_t kLongestLicence = uint64_t{1} << 20;  // bytes
constexpr uint64_t kLongestLibrary = uint64_t{1} << 31;  // bytes, kept in memory
constexpr std::array<float, 9> kIdentity = {1, 0, 0, 0, 1, 0, 0, 0, 1};

std::string FolderOf(const std::string& member) {
  const size_t slash = member.find_last_of('/');
  return slash == std::string::npos ? std::string() : member.substr(0, slash);
}

std::string FileOf(const std::string& member) { return member.substr(member.find_last_of('/') + 1); }

// Parses nine numbers; anything else means the identity.
std::array<float, 9> ParseRotation(const std::string& text) {
  std::array<float, 9> rotation{};
  std::istringstream in(text);
  in.imbue(std::locale::classic());
  for (float& value : rotation) {
    if (!(in >> value) || !std::isfinite(value)) return kIdentity;
  }
  return rotation;
}

void Rotate(const std::array<float, 9>& r, std::array<float, 3>& p) {
  p = {r[0] * p[0] + r[1] * p[1] + r[2] * p[2], r[3] * p[0] + r[4] * p[1] + r[5] * p[2],
       r[6] * p[0] + r[7] * p[1] + r[8] * p[2]};
}

}  // namespace

Result<FurnitureCatalog> FurnitureCatalog::Open(const std::filesystem::path& path, const MeshLimits& limits) {
  FurnitureCatalog catalog;
  catalog.path_ = path.string();
  ANCHORSPLAT_ASSIGN_OR_RETURN(std::string bytes,
                               ReadFileBytes(path, std::max(kLongestLibrary, limits.max_file_bytes)));
  ANCHORSPLAT_ASSIGN_OR_RETURN(ZipReader archive, ZipReader::Open(path.string(), std::move(bytes)));
  catalog.archive_ = std::make_shared<const ZipReader>(std::move(archive));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string list, catalog.archive_->Read(kListName, kLongestList));
  const JavaProperties properties = ParseJavaProperties(list);
  catalog.name_ = properties.Get("name");
  if (catalog.name_.empty()) catalog.name_ = path.stem().string();
  catalog.ReadEntries(properties);
  if (catalog.entries_.empty()) {
    return Error{ErrorCode::kBadFile, Cat(path.string(), ": ", kListName, " lists no object (model#1=…)")};
  }
  catalog.FindLicences(properties);
  return catalog;
}

void FurnitureCatalog::ReadEntries(const JavaProperties& properties) {
  std::map<int64_t, CatalogEntry> by_number;
  for (const auto& [key, value] : properties.entries) {
    const size_t mark = key.find('#');
    if (mark == std::string::npos) continue;
    int64_t number = 0;
    const char* const end = key.data() + key.size();
    const auto parsed = std::from_chars(key.data() + mark + 1, end, number);
    if (parsed.ec != std::errc() || parsed.ptr != end || number < 0) continue;
    CatalogEntry& entry = by_number[number];
    const std::string property = key.substr(0, mark);
    if (property == "name") entry.origin.name = value;
    if (property == "category") entry.origin.category = value;
    if (property == "creator") entry.origin.creator = value;
    if (property == "license") entry.origin.licence = value;
    if (property == "model") entry.model = value.substr(std::min(value.find_first_not_of('/'), value.size()));
    if (property == "modelRotation") entry.rotation = ParseRotation(value);
  }
  for (auto& [number, entry] : by_number) {
    if (entry.model.empty()) continue;  // no such entry
    entry.number = number;
    entry.key = std::filesystem::path(FileOf(entry.model)).stem().string();
    if (entry.rotation == std::array<float, 9>{}) entry.rotation = kIdentity;
    entries_.push_back(std::move(entry));
  }
}

void FurnitureCatalog::FindLicences(const JavaProperties& properties) {
  // Applies to the whole library.
  std::string common = SpdxIdentifier(properties.Get("license"));
  if (common.empty()) common = SpdxIdentifier(properties.header);
  if (common.empty()) common = properties.Get("license");
  // Licence files by folder.
  std::map<std::string, std::string> files;
  for (const std::string& member : archive_->Members()) {
    const std::string name = AsciiLowerCase(FileOf(member));
    if (name.find("licen") == std::string::npos || FolderOf(member).empty()) continue;
    if (name.ends_with(".txt") || name.ends_with(".html") || name.ends_with(".htm") || name.ends_with(".md")) {
      files.emplace(FolderOf(member), member);
    }
  }
  for (CatalogEntry& entry : entries_) {
    MeshOrigin& origin = entry.origin;
    if (const auto file = files.find(FolderOf(entry.model)); file != files.end()) {
      const auto text = archive_->Read(file->second, kLongestLicence);
      std::string id = text.ok() ? SpdxIdentifier(*text) : std::string();
      if (!id.empty()) {
        // A free model with added pictures under the library's licence is subject to both.
        if (id == "CC0-1.0" && common != id && !common.empty() && MentionsAttribution(*text)) id += " AND " + common;
        origin.licence = std::move(id);
        origin.licence_source = file->second;
        continue;
      }
    }
    if (const std::string own = SpdxIdentifier(origin.licence); !own.empty()) origin.licence = own;
    if (origin.licence.empty()) origin.licence = common;
    if (!origin.licence.empty()) origin.licence_source = kListName;
  }
}

const CatalogEntry* FurnitureCatalog::Find(const std::string& key) const {
  const CatalogEntry* by_key = nullptr;
  for (const CatalogEntry& entry : entries_) {
    if (entry.model == key || Cat("#", entry.number) == key) return &entry;
    if (entry.key == key && by_key == nullptr) by_key = &entry;
  }
  return by_key;
}

Result<ImportedMesh> FurnitureCatalog::Read(const CatalogEntry& entry, const MeshReadOptions& options) const {
  const ZipAssets assets(archive_, FolderOf(entry.model));
  ANCHORSPLAT_ASSIGN_OR_RETURN(ImportedMesh imported,
                               ImportMesh(assets, FileOf(entry.model), Cat(path_, "#", Printable(entry.key)), options));
  imported.origin = entry.origin;
  if (entry.rotation != kIdentity) {
    for (auto& p : imported.mesh.positions) Rotate(entry.rotation, p);
    for (auto& n : imported.mesh.normals) Rotate(entry.rotation, n);
  }
  return imported;
}

}  // namespace anchorsplat
