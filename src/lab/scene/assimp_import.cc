#include "scene/assimp_import.h"

#include <assimp/GltfMaterial.h>
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>
#include <cmath>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

#include "core/finite.h"
#include "core/text.h"

namespace anchorsplat {

namespace {

// sRGB transfer function (IEC 61966-2-1).
float SrgbFromLinear(float v) { return v <= 0.0031308f ? 12.92f * v : 1.055f * std::pow(v, 1 / 2.4f) - 0.055f; }

// Material properties needed only during import.
struct Materials {
  std::vector<unsigned> uv_channel;  // per material, the texture coordinate set of its picture
  bool linear = false;               // factors and vertex colours are linear (glTF)

  // Converts a colour to sRGB; non-finite values become 1.
  std::array<float, 4> ToSrgb(const aiColor4D& color) const {
    std::array<float, 4> out = {UnitOr(color.r, 1), UnitOr(color.g, 1), UnitOr(color.b, 1), UnitOr(color.a, 1)};
    if (linear) std::transform(out.begin(), out.begin() + 3, out.begin(), SrgbFromLinear);
    return out;
  }
};

// Path and texture coordinate set of the colour picture; false if the material has none.
bool ColorPicture(const aiMaterial& material, std::string& path, unsigned& channel) {
  for (const aiTextureType type : {aiTextureType_BASE_COLOR, aiTextureType_DIFFUSE}) {
    aiString name;
    if (material.GetTexture(type, 0, &name) != aiReturn_SUCCESS || name.length == 0) continue;
    path = name.C_Str();
    int source = 0;
    if (material.Get(AI_MATKEY_UVWSRC(type, 0), source) == aiReturn_SUCCESS && source >= 0) {
      channel = static_cast<unsigned>(source);
    }
    return true;
  }
  return false;
}

RawMaterial ReadMaterial(const aiMaterial& from, Materials& materials) {
  RawMaterial material;
  aiString text;
  if (from.Get(AI_MATKEY_NAME, text) == aiReturn_SUCCESS) material.name = text.C_Str();
  aiColor4D color;
  material.has_color = from.Get(AI_MATKEY_BASE_COLOR, color) == aiReturn_SUCCESS ||
                       from.Get(AI_MATKEY_COLOR_DIFFUSE, color) == aiReturn_SUCCESS;
  if (material.has_color) {
    const std::array<float, 4> srgb = materials.ToSrgb(color);
    material.color = {srgb[0], srgb[1], srgb[2]};
  }
  float opacity = 1;
  if (from.Get(AI_MATKEY_OPACITY, opacity) == aiReturn_SUCCESS) {
    material.opacity = UnitOr(opacity, 1);
  } else if (material.has_color) {
    material.opacity = UnitOr(color.a, 1);
  }
  int two_sided = 0;
  if (from.Get(AI_MATKEY_TWOSIDED, two_sided) == aiReturn_SUCCESS) material.two_sided = two_sided != 0;
  material.opaque = materials.linear && from.Get(AI_MATKEY_GLTF_ALPHAMODE, text) == aiReturn_SUCCESS &&
                    std::string_view(text.C_Str()) == "OPAQUE";
  if (material.opaque) material.opacity = 1;
  unsigned channel = 0;
  (void)ColorPicture(from, material.picture, channel);
  materials.uv_channel.push_back(channel);
  if (from.GetTexture(aiTextureType_OPACITY, 0, &text) == aiReturn_SUCCESS) material.mask = text.C_Str();
  return material;
}

EmbeddedPicture ReadPicture(const aiTexture& from) {
  EmbeddedPicture picture;
  picture.name = from.mFilename.C_Str();
  if (from.pcData == nullptr) return picture;
  picture.width = from.mWidth;
  picture.height = from.mHeight;
  if (from.mHeight == 0) {  // an encoded file of mWidth bytes
    picture.bytes.assign(reinterpret_cast<const char*>(from.pcData), from.mWidth);
    return picture;
  }
  const size_t pixels = size_t{from.mWidth} * from.mHeight;
  for (size_t i = 0; i < pixels; ++i) {
    const aiTexel& t = from.pcData[i];
    for (const uint8_t v : {t.r, t.g, t.b, t.a}) picture.bytes += static_cast<char>(v);
  }
  return picture;
}

// A mesh placed in the scene.
struct Instance {
  const aiMesh* mesh;
  aiMatrix4x4 to_world;
};

// Flattens the node tree. False above the limit: a tree of n nodes may have n² instances.
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
    for (unsigned i = node->mNumChildren; i-- > 0;) {  // keeps the children's order
      if (node->mChildren[i] != nullptr) open.emplace_back(node->mChildren[i], to_world);
    }
  }
  return true;
}

// Checks sizes before triangulation, which may take long.
void CheckSizes(const aiScene& scene, const MeshLimits& limits) {
  int64_t vertices = 0;
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    const aiMesh& mesh = *scene.mMeshes[m];
    vertices += int64_t{mesh.mNumVertices};
    if (vertices > limits.max_vertices) {
      throw std::runtime_error(Cat("more than ", WithThousands(limits.max_vertices), " vertices"));
    }
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      if (int64_t{mesh.mFaces[f].mNumIndices} > limits.max_polygon) {
        throw std::runtime_error(
            Cat("a face with ", mesh.mFaces[f].mNumIndices, " corners, more than the limit of ", limits.max_polygon));
      }
    }
  }
}

using Vec3 = std::array<float, 3>;

Vec3 ToArray(const aiVector3D& v) { return {v.x, v.y, v.z}; }

// Normalises a normal. Files contain any length, and NaN after divisions by zero; zero requests a computed one.
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

// Appends all triangles of an instance, corner by corner.
void AppendInstance(const Instance& instance, const Materials& materials, RawScene& out) {
  MeshCorners& corners = out.corners;
  const aiMesh& mesh = *instance.mesh;
  const aiMatrix3x3 linear(instance.to_world);
  aiMatrix3x3 for_normals = linear;
  for_normals.Inverse().Transpose();
  const int32_t material = static_cast<int32_t>(std::min<size_t>(mesh.mMaterialIndex, out.materials.size() - 1));
  const unsigned channel = materials.uv_channel[static_cast<size_t>(material)];
  const bool with_uvs = channel < AI_MAX_NUMBER_OF_TEXTURECOORDS && mesh.mTextureCoords[channel] != nullptr;
  const aiColor4D* colors = mesh.mColors[0];
  const bool mirrored = linear.Determinant() < 0;  // mirroring must not flip the winding
  corners.has_uvs |= with_uvs;
  corners.has_colors |= colors != nullptr;
  out.has_normals &= mesh.mNormals != nullptr;
  for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
    const aiFace& face = mesh.mFaces[f];
    if (face.mNumIndices != 3) {
      ++out.not_triangles;
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
    if (!in_range || !AllFinite(p[0].data(), 3) || !AllFinite(p[1].data(), 3) || !AllFinite(p[2].data(), 3)) {
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

}  // namespace

RawScene ImportWithAssimp(const AssimpFileReader& read, const std::string& name, const std::string& ending,
                          const MeshLimits& limits) {
  Assimp::Importer importer;
  importer.SetIOHandler(new AssimpFiles(read));  // owned by the importer
  // Subdivision grows with a power of a number in the file; splitting by back faces is not needed.
  importer.SetPropertyBool(AI_CONFIG_IMPORT_AC_EVAL_SUBDIVISION, false);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_AC_SEPARATE_BFCULL, false);
  const aiScene* scene = importer.ReadFile(name, 0);
  if (scene == nullptr) throw std::runtime_error(Cat("cannot be read: ", Printable(importer.GetErrorString(), 300)));
  CheckSizes(*scene, limits);
  scene = importer.ApplyPostProcessing(aiProcess_Triangulate | aiProcess_TransformUVCoords);
  if (scene == nullptr) throw std::runtime_error("its faces cannot be split into triangles");

  RawScene out;
  Materials materials;
  materials.linear = ending == ".gltf" || ending == ".glb";
  for (unsigned m = 0; m < scene->mNumMaterials; ++m) {
    out.materials.push_back(ReadMaterial(*scene->mMaterials[m], materials));
  }
  if (out.materials.empty()) {
    out.materials.emplace_back();
    materials.uv_channel.push_back(0);
  }
  for (unsigned t = 0; t < scene->mNumTextures; ++t) out.pictures.push_back(ReadPicture(*scene->mTextures[t]));
  std::vector<Instance> instances;
  if (!FlattenTree(*scene, limits.max_vertices, instances)) {
    throw std::runtime_error(Cat("more than ", WithThousands(limits.max_vertices), " vertices with instances"));
  }
  out.has_normals = true;
  for (const Instance& instance : instances) AppendInstance(instance, materials, out);
  if (out.corners.positions.empty()) throw std::runtime_error("has no triangle");
  if (!out.corners.has_uvs) out.corners.uvs.clear();
  if (!out.corners.has_colors) out.corners.colors.clear();
  return out;
}

}  // namespace anchorsplat
