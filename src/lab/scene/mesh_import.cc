#include "scene/mesh_import.h"

#include <algorithm>
#include <array>
#include <exception>
#include <filesystem>
#include <new>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include "core/text.h"
#include "formats/ply/ply_header.h"
#include "io/input_file.h"
#include "scene/assimp_import.h"
#include "scene/imported_materials.h"
#include "scene/isolated_process.h"
#include "scene/obj_materials.h"
#include "scene/raw_scene.h"
#include "scene/smooth_normals.h"
#include "scene/vertex_unifier.h"

namespace anchorsplat {

namespace {

constexpr std::array<std::string_view, 8> kEndings = {".obj", ".gltf", ".glb", ".ply", ".dae", ".ac", ".stl", ".off"};

std::string Ending(const std::string& name) {
  std::string ending = std::filesystem::path(name).extension().string();
  for (char& c : ending) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return ending;
}

// Checks a PLY header: assimp trusts it and loops over the announced rows, perhaps 10^308.
Status CheckPly(const std::string& bytes) {
  const InputFile head = InputFile::FromBytes("header", bytes.substr(0, kMaxPlyHeader));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const PlyHeader header, ReadPlyHeader(head));
  uint64_t left = bytes.size() - std::min<uint64_t>(bytes.size(), header.body);
  for (const PlyElement& element : header.elements) {
    // In ASCII, a value takes at least a digit and a separator.
    const uint64_t row = header.encoding == PlyEncoding::kAscii ? 2 * element.properties.size() : element.row_size();
    const auto count = static_cast<uint64_t>(element.count);
    if (count > 0 && (row == 0 || count > (left + 1) / row)) {
      return Error{ErrorCode::kBadFile, Cat("header: line ", element.line, ": ", element.count, " of element \"",
                                            Printable(element.name), "\" do not fit into the file")};
    }
    left -= std::min(left, count * row);
  }
  return {};
}

// Serves the files that assimp requests. Reads the mesh itself once, after checking that it exists.
class FileDesk {
 public:
  FileDesk(const AssetSource& source, const MeshLimits& limits) : source_(source), limits_(limits) {}

  Status ReadMesh(const std::string& name) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(bytes_, source_.Read(name, limits_.max_file_bytes));
    name_ = name;
    if (Ending(name) == ".obj") {
      lines_and_points_ = BlankLinesAndPoints(bytes_);
      material_names_ = ReadObjMaterialNames(bytes_);
    }
    if (Ending(name) == ".ply") return CheckPly(bytes_);
    return {};
  }
  std::optional<std::string> Read(const std::string& name) {
    if (name == name_) return bytes_;
    auto bytes = source_.Read(name, limits_.max_file_bytes);
    if (bytes.ok() && Ending(name) == ".mtl") AddDefinedMaterials(*bytes, defined_);
    return bytes.ok() ? std::optional(*std::move(bytes)) : std::nullopt;
  }
  int64_t lines_and_points() const { return lines_and_points_; }

  // Warns of materials missing for an OBJ file. assimp silently makes unknown ones grey, and tries a name of its own
  // for a missing library, which must not be reported.
  void WarnOfMaterials(std::vector<std::string>& warnings) const {
    for (const std::string& library : material_names_.libraries) {
      if (source_.Has(library)) continue;
      warnings.push_back(
          Cat("material library \"", Printable(library), "\" is ", source_.Refuses(library) ? kRefusal : "missing"));
    }
    int64_t unknown = 0;
    std::string list;
    constexpr int64_t kMostNames = 10;  // a file may have thousands
    for (const std::string& name : material_names_.used) {
      if (defined_.count(name) == 0 && ++unknown <= kMostNames)
        list += Cat(unknown > 1 ? ", " : "", '"', Printable(name), '"');
    }
    if (unknown == 0) return;
    if (unknown > kMostNames) list += Cat(" and ", unknown - kMostNames, " more");
    warnings.push_back(Cat(unknown == 1 ? "material " : "materials ", list, unknown == 1 ? " is" : " are",
                           " in no material library: drawn grey"));
  }

 private:
  const AssetSource& source_;
  const MeshLimits& limits_;
  std::string name_, bytes_;
  ObjMaterialNames material_names_;
  std::set<std::string> defined_;
  int64_t lines_and_points_ = 0;
};

// Runs assimp in a separate process: 5.2 crashes, asserts or loops on damaged files of every format but STL.
Result<RawScene> ReadScene(FileDesk& desk, const std::string& name, const MeshReadOptions& options) {
  const std::string ending = Ending(name);
  if (!options.isolated) {
    return ImportWithAssimp([&](const std::string& file) { return desk.Read(file); }, name, ending, options.limits);
  }
  IsolationLimits limits;
  limits.max_memory = options.limits.max_memory;
  limits.max_cpu_seconds = options.limits.max_cpu_seconds;
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string packed,
                               RunIsolated(
                                   limits,
                                   [&](const AskParent& ask) {
                                     return Pack(ImportWithAssimp(
                                         [&](const std::string& file) -> std::optional<std::string> {
                                           std::string reply = ask(file);
                                           if (reply.empty()) return std::nullopt;
                                           return reply.substr(1);
                                         },
                                         name, ending, options.limits));
                                   },
                                   [&](std::string_view file) {
                                     // One byte indicates existence, as the file may be empty.
                                     const auto bytes = desk.Read(std::string(file));
                                     return bytes ? "1" + *bytes : std::string();
                                   }));
  return Unpack(packed);
}

Result<ImportedMesh> Import(const AssetSource& source, const std::string& name, const MeshReadOptions& options) {
  if (!IsMeshName(name)) {
    return Error{ErrorCode::kBadFile, "has no mesh extension (obj, gltf, glb, ply, dae, ac, stl, off)"};
  }
  FileDesk desk(source, options.limits);
  ANCHORSPLAT_RETURN_IF_ERROR(desk.ReadMesh(name));
  ANCHORSPLAT_ASSIGN_OR_RETURN(RawScene scene, ReadScene(desk, name, options));
  ImportedMesh out;
  FillSmoothNormals(scene.corners.positions, options.smoothing_angle, scene.corners.normals);
  out.mesh = UnifyVertices(scene.corners);
  desk.WarnOfMaterials(out.warnings);
  LoadMaterials(scene, source, Ending(name), options.limits, out.mesh, out.warnings);
  RemoveUnusedMaterials(out.mesh);
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(out.mesh));
  out.degenerate = scene.degenerate;
  out.not_finite = scene.not_finite;
  out.lines_and_points = desk.lines_and_points() + scene.not_triangles;
  out.has_normals = scene.has_normals;
  if (out.degenerate > 0) out.warnings.push_back(Cat(out.degenerate, " triangles without area skipped"));
  if (out.not_finite > 0)
    out.warnings.push_back(Cat(out.not_finite, " triangles with corners that are not finite skipped"));
  return out;
}

}  // namespace

bool IsMeshName(const std::string& name) {
  return std::find(kEndings.begin(), kEndings.end(), Ending(name)) != kEndings.end();
}

Result<ImportedMesh> ImportMesh(const AssetSource& source, const std::string& name, const std::string& where,
                                const MeshReadOptions& options) {
  // A large file may still exhaust memory; assimp throws when run in this process.
  try {
    auto imported = Import(source, name, options);
    if (!imported.ok()) return Error{imported.error().code, Cat(where, ": ", imported.error().message)};
    return imported;
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::kBadFile, Cat(where, ": needs more memory than available")};
  } catch (const std::exception& e) {
    return Error{ErrorCode::kBadFile, Cat(where, ": ", Printable(e.what(), 300))};
  }
}

}  // namespace anchorsplat
