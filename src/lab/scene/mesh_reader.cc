#include "scene/mesh_reader.h"

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

#include "core/ascii_lower_case.h"
#include "core/text.h"
#include "io/file_bytes.h"
#include "scene/furniture_catalog.h"
#include "scene/licence.h"

namespace anchorsplat {

namespace fs = std::filesystem;

namespace {

constexpr std::string_view kLibraryEnding = ".sh3f";

struct Address {
  std::string file;
  std::string object;  // in a library; "" for a file or a whole library
  bool library = false;
};

Address Parse(const std::string& address) {
  const size_t ending = AsciiLowerCase(address).rfind(kLibraryEnding);
  if (ending != std::string::npos) {
    const size_t end = ending + kLibraryEnding.size();
    if (end == address.size()) return {address, {}, true};
    if (address[end] == '#') return {address.substr(0, end), address.substr(end + 1), true};
  }
  return {address, {}, false};
}

// Finds a licence file beside the mesh; the first by name, for determinism.
void FindLicenceBeside(const fs::path& path, MeshOrigin& origin) {
  std::vector<fs::path> candidates;
  std::error_code error;
  const fs::path folder = path.parent_path().empty() ? fs::path(".") : path.parent_path();
  constexpr int kMostEntries = 10'000;
  int seen = 0;
  for (fs::directory_iterator it(folder, error), end; !error && it != end && ++seen <= kMostEntries;
       it.increment(error)) {
    const std::string name = AsciiLowerCase(it->path().filename().string());
    const std::string ending = fs::path(name).extension().string();
    const bool named = name.find("licen") != std::string::npos || name.find("copying") != std::string::npos;
    const bool text = ending.empty() || ending == ".txt" || ending == ".html" || ending == ".md";
    std::error_code ignored;
    if (named && text && it->is_regular_file(ignored)) {
      candidates.push_back(it->path());
    }
  }
  std::sort(candidates.begin(), candidates.end());
  for (const fs::path& candidate : candidates) {
    const auto text = ReadFileBytes(candidate, uint64_t{1} << 20);
    if (!text.ok()) continue;
    origin.licence = SpdxIdentifier(*text);
    if (origin.licence.empty()) continue;
    origin.licence_source = candidate.filename().string();
    return;
  }
  if (candidates.empty()) return;
  // A licence file exists, but we do not recognise the licence.
  origin.licence_source = candidates.front().filename().string();
  origin.licence = Cat("licence not recognised, see ", Printable(origin.licence_source));
}

}  // namespace

bool IsMeshAddress(const std::string& address) { return Parse(address).library || IsMeshName(address); }

bool IsMeshLibrary(const std::string& address) {
  const Address parsed = Parse(address);
  return parsed.library && parsed.object.empty();
}

std::string MeshShortName(const std::string& address) {
  const Address parsed = Parse(address);
  const std::string& name = parsed.object.empty() ? parsed.file : parsed.object;
  const fs::path last = name.substr(name.find_last_of('/') + 1);
  // Dots in library keys and picture folders do not start an extension.
  return (IsMeshName(name) || IsMeshLibrary(name) ? last.stem() : last).string();
}

Result<std::vector<std::string>> ExpandMeshAddress(const std::string& address) {
  const Address parsed = Parse(address);
  if (!parsed.library || !parsed.object.empty()) return std::vector<std::string>{address};
  ANCHORSPLAT_ASSIGN_OR_RETURN(const FurnitureCatalog catalog, FurnitureCatalog::Open(parsed.file));
  std::vector<std::string> all;
  for (const CatalogEntry& entry : catalog.entries()) {
    // Shared keys are distinguished by number.
    const bool unique = catalog.Find(entry.key) == &entry;
    all.push_back(unique ? Cat(parsed.file, "#", entry.key) : Cat(parsed.file, "##", entry.number));
  }
  return all;
}

Result<ImportedMesh> ReadMesh(const std::string& address, const MeshReadOptions& options) {
  const Address parsed = Parse(address);
  if (parsed.library) {
    if (parsed.object.empty()) {
      return Error{ErrorCode::kBadArgument,
                   Cat(address, ": is a library of several objects; choose one with ", address, "#object")};
    }
    ANCHORSPLAT_ASSIGN_OR_RETURN(const FurnitureCatalog catalog, FurnitureCatalog::Open(parsed.file, options.limits));
    const CatalogEntry* entry = catalog.Find(parsed.object);
    if (entry == nullptr) {
      return Error{ErrorCode::kNotFound, Cat(parsed.file, ": has no object \"", Printable(parsed.object), "\"")};
    }
    return catalog.Read(*entry, options);
  }
  const fs::path path(address);
  const FolderAssets assets(path.parent_path());
  ANCHORSPLAT_ASSIGN_OR_RETURN(ImportedMesh imported, ImportMesh(assets, path.filename().string(), address, options));
  imported.origin.name = path.stem().string();
  FindLicenceBeside(path, imported.origin);
  return imported;
}

}  // namespace anchorsplat
