#include <zlib.h>

#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "cli/clean_output.h"
#include "cli/lab.h"
#include "cli/table.h"
#include "core/file_system.h"
#include "core/log.h"
#include "core/parallel.h"
#include "core/text.h"
#include "formats/opened_splat.h"
#include "formats/registry.h"
#include "io/input_file.h"
#include "scene/furniture_catalog.h"
#include "scene/mesh_reader.h"
#include "scene/mesh_summary.h"

namespace anchorsplat {

namespace {

// Findings of a mesh, without its triangles: those of a library would take gigabytes.
struct MeshFindings {
  std::string address;
  MeshOrigin origin;
  std::vector<std::string> warnings;
  int64_t degenerate = 0;
  int64_t lines_and_points = 0;
  bool has_normals = false;
  bool has_vertex_colors = false;
  MeshSummary summary;
  struct Picture {
    std::string name;
    int width = 0, height = 0;
    bool has_alpha = false;
    uint32_t crc32 = 0;  // of the decoded pixels: the same picture under another name
  };
  std::vector<Picture> pictures;
};

MeshFindings Find(const std::string& address, ImportedMesh imported) {
  MeshFindings f{address,
                 std::move(imported.origin),
                 std::move(imported.warnings),
                 imported.degenerate,
                 imported.lines_and_points,
                 imported.has_normals,
                 !imported.mesh.colors.empty(),
                 {},
                 {}};
  for (const Texture& texture : imported.mesh.textures) {
    f.pictures.push_back({texture.name, texture.width, texture.height, texture.has_alpha,
                          static_cast<uint32_t>(crc32_z(0, texture.rgba.data(), texture.rgba.size()))});
  }
  f.summary = Summarize(std::move(imported.mesh));
  return f;
}

nlohmann::json ToJson(const MeshOrigin& origin) {
  return {{"name", origin.name},
          {"category", origin.category},
          {"creator", origin.creator},
          {"licence", origin.licence},
          {"licence_source", origin.licence_source}};
}

nlohmann::json ToJson(const MeshFindings& f) {
  nlohmann::json json = ToJson(f.origin);
  const MeshSummary& s = f.summary;
  json.update({{"file", f.address},
               {"kind", "mesh"},
               {"triangles", s.triangles},
               {"vertices", s.vertices},
               {"materials", s.materials},
               {"textures", s.textures},
               {"colours", s.colors},
               {"bounds", {{"min", s.low}, {"max", s.high}}},
               {"shape", s.shape},
               {"has_normals", f.has_normals},
               {"has_vertex_colours", f.has_vertex_colors},
               {"degenerate", f.degenerate},
               {"lines_and_points", f.lines_and_points},
               {"warnings", f.warnings},
               {"pictures", nlohmann::json::array()}});
  for (const MeshFindings::Picture& picture : f.pictures) {
    json["pictures"].push_back({{"name", picture.name},
                                {"width", picture.width},
                                {"height", picture.height},
                                {"has_alpha", picture.has_alpha},
                                {"crc32", picture.crc32}});
  }
  return json;
}

void PrintMeshTable(const MeshFindings& f) {
  const MeshSummary& s = f.summary;
  const auto line = [](const char* name, const std::string& value) {
    if (!value.empty()) std::cout << "  " << name << "  " << value << "\n";
  };
  std::cout << OneLine(f.address) << "\n";
  line("object    ", Printable(f.origin.name, 200));
  line("category  ", Printable(f.origin.category, 200));
  line("creator   ", Printable(f.origin.creator, 200));
  line("licence   ", f.origin.licence.empty() ? "not stated" : Printable(f.origin.licence, 200));
  line("triangles ", Cat(WithThousands(s.triangles), ", vertices ", WithThousands(s.vertices), ", normals ",
                         f.has_normals ? "of the file" : "made from the triangles"));
  line("materials ", Cat(s.materials, ", textures ", s.textures, ", colours without texture ", s.colors));
  for (const MeshFindings::Picture& picture : f.pictures) {
    line("picture   ", Cat(Printable(picture.name), ", ", picture.width, " x ", picture.height,
                           picture.has_alpha ? ", with transparent parts" : ""));
  }
  line("size      ", Cat(s.high[0] - s.low[0], " x ", s.high[1] - s.low[1], " x ", s.high[2] - s.low[2]));
  std::cout << "\n" << (f.warnings.empty() ? "no problems found" : "found:") << "\n";
  for (const std::string& warning : f.warnings) std::cout << "  - " << OneLine(warning) << "\n";
}

Status RunLibraryInfo(const std::string& path, const SharedFlags& shared) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const FurnitureCatalog catalog, FurnitureCatalog::Open(path));
  const std::vector<CatalogEntry>& entries = catalog.entries();
  std::vector<Result<MeshFindings>> all(entries.size(), Error{});
  {
    Progress progress("objects", static_cast<int64_t>(entries.size()));
    ParallelFor(0, static_cast<int64_t>(entries.size()), 1, [&](int64_t begin, int64_t) {
      const CatalogEntry& entry = entries[static_cast<size_t>(begin)];
      const bool unique = catalog.Find(entry.key) == &entry;
      const std::string address = unique ? Cat(path, "#", entry.key) : Cat(path, "##", entry.number);
      auto imported = catalog.Read(entry);
      if (imported.ok()) {
        all[static_cast<size_t>(begin)] = Find(address, *std::move(imported));
      } else {
        all[static_cast<size_t>(begin)] = imported.error();
      }
      progress.Advance();
    });
  }
  if (shared.json) {
    nlohmann::json objects = nlohmann::json::array();
    for (size_t i = 0; i < all.size(); ++i) {
      nlohmann::json object = all[i].ok() ? ToJson(*all[i]) : ToJson(entries[i].origin);
      if (!all[i].ok()) object["error"] = all[i].error().message;
      object["key"] = entries[i].key;
      object["number"] = entries[i].number;
      object["model"] = entries[i].model;
      objects.push_back(std::move(object));
    }
    PrintJson({{"file", path}, {"kind", "library"}, {"name", catalog.name()}, {"objects", objects}});
    return {};
  }
  std::vector<std::vector<std::string>> rows = {
      {"object", "name", "category", "creator", "licence", "triangles", "textures", "colours"}};
  for (size_t i = 0; i < all.size(); ++i) {
    const MeshOrigin& o = entries[i].origin;
    std::vector<std::string> row = {Printable(entries[i].key, 40), Printable(o.name, 40), Printable(o.category, 30),
                                    Printable(o.creator, 30), Printable(o.licence, 30)};
    if (all[i].ok()) {
      const MeshSummary& s = all[i]->summary;
      row.insert(row.end(), {WithThousands(s.triangles), Cat(s.textures), Cat(s.colors)});
    } else {
      row.insert(row.end(), {"unreadable", "", ""});
    }
    rows.push_back(std::move(row));
  }
  std::cout << OneLine(path) << ": " << Printable(catalog.name(), 200) << ", " << entries.size() << " objects\n\n"
            << FormatTable(rows);
  for (const auto& result : all) {
    if (!result.ok()) LogWarning(result.error().message);
  }
  return {};
}

// Start of a file, which usually has the header of a PLY or the extensions of a glTF.
std::string Beginning(const std::string& path) {
  if (!IsFile(path)) return {};
  const auto in = InputFile::Open(path);
  const auto head = in.ok() ? in->Head(size_t{1} << 16) : Result<std::string>(in.error());
  return head.ok() ? *head : std::string();
}

}  // namespace

bool LooksLikeMesh(const std::string& address) {
  if (!IsMeshAddress(address)) return false;
  const std::string ending = std::filesystem::path(address).extension().string();
  const std::string beginning = Beginning(address);
  const auto contains = [&](const char* words) { return beginning.find(words) != std::string::npos; };
  // By content first: a splat may have faces and any name.
  const SplatFormat* const format = FormatOfFile(beginning, {});
  if (format == nullptr) return ending != ".ply" && ending != ".glb" && ending != ".gltf";
  if (format->name == "PLY") return contains("element face") && !ExtentOf(address);
  return format->name.starts_with("glTF") && !contains("KHR_gaussian_splatting");
}

Status RunMeshInfo(const std::string& address, const SharedFlags& shared) {
  if (IsMeshLibrary(address)) return RunLibraryInfo(address, shared);
  ANCHORSPLAT_ASSIGN_OR_RETURN(ImportedMesh imported, ReadMesh(address));
  const MeshFindings findings = Find(address, std::move(imported));
  if (shared.json) {
    PrintJson(ToJson(findings));
  } else {
    PrintMeshTable(findings);
  }
  return {};
}

}  // namespace anchorsplat
