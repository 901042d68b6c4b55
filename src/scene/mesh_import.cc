#include "scene/mesh_import.h"

#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>
#include <cmath>
#include <exception>
#include <filesystem>
#include <memory>
#include <new>
#include <string_view>
#include <utility>

#include "core/text.h"
#include "scene/assimp_files.h"
#include "scene/imported_materials.h"
#include "scene/smooth_normals.h"
#include "scene/vertex_unifier.h"

namespace anchorsplat {

namespace {

constexpr std::array<std::string_view, 8> kEndings = {".obj", ".gltf", ".glb", ".ply",
                                                      ".dae", ".ac",   ".stl", ".off"};

std::string Ending(const std::string& name) {
  std::string ending = std::filesystem::path(name).extension().string();
  for (char& c : ending) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return ending;
}

// One mesh of the file at one place of the scene.
struct Instance {
  const aiMesh* mesh;
  aiMatrix4x4 to_world;
};

// The scene's tree flattened. False when there is more than the limit: a tree of n nodes may hold n² instances.
bool FlattenTree(const aiScene& scene, int64_t max_vertices, std::vector<Instance>& instances) {
  std::vector<std::pair<const aiNode*, aiMatrix4x4>> open;
  if (scene.mRootNode != nullptr) open.emplace_back(scene.mRootNode, aiMatrix4x4());
  int64_t vertices = 0;
  while (!open.empty()) {
    const auto [node, parent] = open.back();
    open.pop_back();
    const aiMatrix4x4 to_world = parent * node->mTransformation;
    for (unsigned i = 0; i < node->mNumMeshes; ++i) {
      if (node->mMeshes[i] >= scene.mNumMeshes) continue;
      const aiMesh* mesh = scene.mMeshes[node->mMeshes[i]];
      vertices += int64_t{mesh->mNumVertices};
      if (vertices > max_vertices || static_cast<int64_t>(instances.size()) > max_vertices) return false;
      instances.push_back({mesh, to_world});
    }
    for (unsigned i = node->mNumChildren; i-- > 0;) {  // so that children come out in their order
      if (node->mChildren[i] != nullptr) open.emplace_back(node->mChildren[i], to_world);
    }
  }
  return true;
}

// Sizes are known now; cutting polygons into triangles is what may take long.
Status CheckSizes(const aiScene& scene, const std::string& where, const MeshLimits& limits) {
  int64_t vertices = 0;
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    const aiMesh& mesh = *scene.mMeshes[m];
    vertices += int64_t{mesh.mNumVertices};
    if (vertices > limits.max_vertices) {
      return Error{ErrorCode::kBadFile, Cat(where, ": more than ", WithThousands(limits.max_vertices), " vertices")};
    }
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      if (int64_t{mesh.mFaces[f].mNumIndices} > limits.max_polygon) {
        return Error{ErrorCode::kBadFile, Cat(where, ": a face with ", mesh.mFaces[f].mNumIndices, " corners, at most ",
                                              limits.max_polygon, " are read")};
      }
    }
  }
  return {};
}

using Vec3 = std::array<float, 3>;

Vec3 ToArray(const aiVector3D& v) { return {v.x, v.y, v.z}; }

bool Finite(const Vec3& p) { return std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]); }

// Normals come in any length, and as NaN where a file's own program divided by zero; zero asks for one of ours.
Vec3 UnitOrZero(const aiVector3D& v) {
  const double length = std::sqrt(double{v.x} * v.x + double{v.y} * v.y + double{v.z} * v.z);
  if (!(length > 0) || !std::isfinite(length)) return {0, 0, 0};
  return {static_cast<float>(v.x / length), static_cast<float>(v.y / length), static_cast<float>(v.z / length)};
}

bool HasArea(const Vec3& a, const Vec3& b, const Vec3& c) {
  const double u[3] = {double{b[0]} - a[0], double{b[1]} - a[1], double{b[2]} - a[2]};
  const double v[3] = {double{c[0]} - a[0], double{c[1]} - a[1], double{c[2]} - a[2]};
  return u[1] * v[2] - u[2] * v[1] != 0 || u[2] * v[0] - u[0] * v[2] != 0 || u[0] * v[1] - u[1] * v[0] != 0;
}

float FiniteOr(float value, float otherwise) { return std::isfinite(value) ? value : otherwise; }

// All triangles of one instance, appended corner by corner.
void AppendInstance(const Instance& instance, const ImportedMaterials& materials, ImportedMesh& out,
                    MeshCorners& corners) {
  const aiMesh& mesh = *instance.mesh;
  const aiMatrix3x3 linear(instance.to_world);
  aiMatrix3x3 for_normals = linear;
  for_normals.Inverse().Transpose();
  const int32_t material = static_cast<int32_t>(std::min<size_t>(mesh.mMaterialIndex, materials.list.size() - 1));
  const unsigned channel = materials.uv_channel[static_cast<size_t>(material)];
  const bool with_uvs = channel < AI_MAX_NUMBER_OF_TEXTURECOORDS && mesh.mTextureCoords[channel] != nullptr;
  const aiColor4D* colors = mesh.mColors[0];
  const bool mirrored = linear.Determinant() < 0;  // keeps the winding that normals are made from
  corners.has_uvs |= with_uvs;
  corners.has_colors |= colors != nullptr;
  out.has_normals &= mesh.mNormals != nullptr;
  for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
    const aiFace& face = mesh.mFaces[f];
    if (face.mNumIndices != 3) {
      ++out.lines_and_points;
      continue;
    }
    std::array<uint32_t, 3> index = {face.mIndices[0], face.mIndices[1], face.mIndices[2]};
    if (mirrored) std::swap(index[1], index[2]);
    std::array<Vec3, 3> p;
    bool in_range = true;
    for (size_t k = 0; k < 3 && in_range; ++k) {
      in_range = index[k] < mesh.mNumVertices;
      if (in_range) p[k] = ToArray(instance.to_world * mesh.mVertices[index[k]]);
    }
    if (!in_range || !Finite(p[0]) || !Finite(p[1]) || !Finite(p[2])) {
      ++out.not_finite;
      continue;
    }
    if (!HasArea(p[0], p[1], p[2])) {
      ++out.degenerate;
      continue;
    }
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t v = index[k];
      corners.positions.push_back(p[k]);
      corners.normals.push_back(mesh.mNormals != nullptr ? UnitOrZero(for_normals * mesh.mNormals[v]) : Vec3{0, 0, 0});
      if (with_uvs) {
        const aiVector3D& uv = mesh.mTextureCoords[channel][v];
        corners.uvs.push_back({FiniteOr(uv.x, 0), FiniteOr(uv.y, 0)});
      } else {
        corners.uvs.push_back({0, 0});
      }
      corners.colors.push_back(colors != nullptr ? materials.ToSrgb(colors[v]) : std::array<float, 4>{1, 1, 1, 1});
    }
    corners.materials.push_back(material);
  }
}

Result<ImportedMesh> Import(const AssetSource& source, const std::string& name, const std::string& where,
                            const MeshReadOptions& options) {
  if (!IsMeshName(name)) {
    return Error{ErrorCode::kBadFile,
                 Cat(where, ": not a mesh by its ending (obj, gltf, glb, ply, dae, ac, stl, off)")};
  }
  // Read here first: assimp could not say whether the file is missing, too long or refused.
  auto bytes = source.Read(name, options.limits.max_file_bytes);
  if (!bytes.ok()) return Error{bytes.error().code, Cat(where, ": ", bytes.error().message)};
  ImportedMesh out;
  if (Ending(name) == ".obj") out.lines_and_points = BlankLinesAndPoints(*bytes);
  bytes->clear();
  bytes->shrink_to_fit();

  Assimp::Importer importer;
  std::vector<std::string> missing;
  importer.SetIOHandler(new AssimpFiles(&source, options.limits.max_file_bytes, &missing));  // owned by the importer
  // Subdivision surfaces grow with a power of a number in the file; splitting by back faces changes nothing for us.
  importer.SetPropertyBool(AI_CONFIG_IMPORT_AC_EVAL_SUBDIVISION, false);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_AC_SEPARATE_BFCULL, false);
  const aiScene* scene = importer.ReadFile(name, 0);
  if (scene == nullptr) {
    return Error{ErrorCode::kBadFile, Cat(where, ": cannot be read: ", Printable(importer.GetErrorString(), 300))};
  }
  // Whatever else assimp tries is a guess of its own.
  for (const std::string& file : missing) {
    if (file.ends_with(".mtl")) out.warnings.push_back(Cat("material library \"", Printable(file), "\" is missing"));
  }
  ANCHORSPLAT_RETURN_IF_ERROR(CheckSizes(*scene, where, options.limits));
  scene = importer.ApplyPostProcessing(aiProcess_Triangulate | aiProcess_TransformUVCoords);
  if (scene == nullptr) return Error{ErrorCode::kBadFile, Cat(where, ": its faces cannot be cut into triangles")};

  std::vector<Instance> instances;
  if (!FlattenTree(*scene, options.limits.max_vertices, instances)) {
    return Error{ErrorCode::kBadFile,
                 Cat(where, ": more than ", WithThousands(options.limits.max_vertices), " vertices with instances")};
  }
  ImportedMaterials materials = ImportMaterials(*scene, source, Ending(name), options.limits, out.warnings);
  MeshCorners corners;
  out.has_normals = true;
  for (const Instance& instance : instances) AppendInstance(instance, materials, out, corners);
  if (corners.positions.empty()) return Error{ErrorCode::kBadFile, Cat(where, ": has no triangle")};
  FillSmoothNormals(corners.positions, options.smoothing_angle, corners.normals);
  out.mesh = UnifyVertices(corners);
  out.mesh.materials = std::move(materials.list);
  out.mesh.textures = std::move(materials.textures);
  RemoveUnusedMaterials(out.mesh);
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(out.mesh));
  if (out.degenerate > 0) out.warnings.push_back(Cat(out.degenerate, " triangles without area are left out"));
  if (out.not_finite > 0)
    out.warnings.push_back(Cat(out.not_finite, " triangles with impossible corners are left out"));
  return out;
}

}  // namespace

bool IsMeshName(const std::string& name) {
  return std::find(kEndings.begin(), kEndings.end(), Ending(name)) != kEndings.end();
}

Result<ImportedMesh> ImportMesh(const AssetSource& source, const std::string& name, const std::string& where,
                                const MeshReadOptions& options) {
  // assimp reports by exceptions in places, and a hostile size may still end in bad_alloc.
  try {
    return Import(source, name, where, options);
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::kBadFile, Cat(where, ": asks for more memory than there is")};
  } catch (const std::exception& e) {
    return Error{ErrorCode::kBadFile, Cat(where, ": cannot be read: ", Printable(e.what(), 300))};
  }
}

}  // namespace anchorsplat
