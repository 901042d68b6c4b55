#include "scene/mesh_file.h"

#include <cstring>
#include <string>
#include <vector>

#include "core/text.h"
#include "tensors/safetensors.h"
#include "tensors/tensor_file.h"

namespace anchorsplat {

namespace {

// Tensor entry viewing a vector of numbers or of arrays of numbers.
template <typename T>
TensorEntry Entry(std::string name, TensorType type, std::vector<int64_t> shape, const std::vector<T>& values) {
  TensorEntry entry;
  entry.name = std::move(name);
  entry.type = type;
  entry.strides = RowMajorStrides(shape);
  entry.shape = std::move(shape);
  entry.data = reinterpret_cast<const std::byte*>(values.data());
  return entry;
}

std::string TextureName(size_t i) { return Cat("texture.", i); }

// Copies tensor `name` of `type`, any number of rows of `columns` (0: scalars), to `out`.
template <typename T>
Status Take(const TensorFile& file, const std::string& name, TensorType type, int64_t columns, std::vector<T>& out) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const TensorEntry* entry, file.Require(name));
  const bool rows = columns == 0 ? entry->shape.size() == 1 : entry->shape.size() == 2 && entry->shape[1] == columns;
  if (!rows || entry->type != type) {
    return Error{ErrorCode::kBadFile, Cat(file.name(), ": ", name, " is ", TypeName(entry->type), " ",
                                          entry->ShapeText(), ", not the type or shape of a mesh file")};
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const Buffer<std::byte> bytes, CopyContiguous(*entry));
  out.resize(static_cast<size_t>(entry->shape[0]));
  if (!out.empty()) std::memcpy(static_cast<void*>(out.data()), bytes.data(), bytes.size());
  return {};
}

Status TakeTextures(const TensorFile& file, Mesh& mesh) {
  for (size_t i = 0; file.Find(TextureName(i)) != nullptr; ++i) {
    const TensorEntry& entry = *file.Find(TextureName(i));
    if (entry.type != TensorType::kUint8 || entry.shape.size() != 3 || entry.shape[2] != 4 || entry.shape[0] < 1 ||
        entry.shape[1] < 1 || entry.shape[0] > 65536 || entry.shape[1] > 65536) {
      return Error{ErrorCode::kBadFile, Cat(file.name(), ": ", entry.name, " is ", TypeName(entry.type), " ",
                                            entry.ShapeText(), ", not a texture of bytes [H,W,4]")};
    }
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Buffer<std::byte> bytes, CopyContiguous(entry));
    Texture& texture = mesh.textures.emplace_back();
    texture.height = static_cast<int>(entry.shape[0]);
    texture.width = static_cast<int>(entry.shape[1]);
    texture.rgba.resize(bytes.size());
    std::memcpy(texture.rgba.data(), bytes.data(), bytes.size());
    for (size_t a = 3; a < texture.rgba.size(); a += 4) texture.has_alpha |= texture.rgba[a] < 255;
  }
  return {};
}

}  // namespace

Status WriteMeshFile(const std::filesystem::path& path, const Mesh& mesh, const WriteOptions& options) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(mesh));
  const int64_t vertices = std::ssize(mesh.positions), triangles = std::ssize(mesh.triangles);
  const int64_t materials = std::ssize(mesh.materials);
  std::vector<std::array<float, 4>> colors;
  std::vector<int32_t> textures, flags;
  for (const Material& m : mesh.materials) {
    colors.push_back({m.diffuse[0], m.diffuse[1], m.diffuse[2], m.opacity});
    textures.push_back(m.texture);
    flags.push_back((m.two_sided ? 1 : 0) + (m.lit ? 2 : 0));
  }
  std::vector<TensorEntry> tensors = {
      Entry("positions", TensorType::kFloat32, {vertices, 3}, mesh.positions),
      Entry("triangles", TensorType::kUint32, {triangles, 3}, mesh.triangles),
      Entry("triangle_materials", TensorType::kInt32, {triangles}, mesh.triangle_materials),
      Entry("materials", TensorType::kFloat32, {materials, 4}, colors),
      Entry("material_textures", TensorType::kInt32, {materials}, textures),
      Entry("material_flags", TensorType::kInt32, {materials}, flags)};
  if (!mesh.normals.empty()) tensors.push_back(Entry("normals", TensorType::kFloat32, {vertices, 3}, mesh.normals));
  if (!mesh.uvs.empty()) tensors.push_back(Entry("uvs", TensorType::kFloat32, {vertices, 2}, mesh.uvs));
  if (!mesh.colors.empty()) tensors.push_back(Entry("colors", TensorType::kFloat32, {vertices, 4}, mesh.colors));
  for (size_t i = 0; i < mesh.textures.size(); ++i) {
    const Texture& t = mesh.textures[i];
    tensors.push_back(Entry(TextureName(i), TensorType::kUint8, {t.height, t.width, 4}, t.rgba));
  }
  return WriteSafetensors(path, tensors, {{"format", "anchorsplat mesh 1"}}, options);
}

Result<Mesh> ReadMeshFile(const std::filesystem::path& path) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const TensorFile file, TensorFile::Open(path));
  Mesh mesh;
  std::vector<std::array<float, 4>> colors;
  std::vector<int32_t> textures, flags;
  ANCHORSPLAT_RETURN_IF_ERROR(Take(file, "positions", TensorType::kFloat32, 3, mesh.positions));
  ANCHORSPLAT_RETURN_IF_ERROR(Take(file, "triangles", TensorType::kUint32, 3, mesh.triangles));
  ANCHORSPLAT_RETURN_IF_ERROR(Take(file, "triangle_materials", TensorType::kInt32, 0, mesh.triangle_materials));
  ANCHORSPLAT_RETURN_IF_ERROR(Take(file, "materials", TensorType::kFloat32, 4, colors));
  ANCHORSPLAT_RETURN_IF_ERROR(Take(file, "material_textures", TensorType::kInt32, 0, textures));
  ANCHORSPLAT_RETURN_IF_ERROR(Take(file, "material_flags", TensorType::kInt32, 0, flags));
  if (file.Find("normals") != nullptr) {
    ANCHORSPLAT_RETURN_IF_ERROR(Take(file, "normals", TensorType::kFloat32, 3, mesh.normals));
  }
  if (file.Find("uvs") != nullptr) {
    ANCHORSPLAT_RETURN_IF_ERROR(Take(file, "uvs", TensorType::kFloat32, 2, mesh.uvs));
  }
  if (file.Find("colors") != nullptr) {
    ANCHORSPLAT_RETURN_IF_ERROR(Take(file, "colors", TensorType::kFloat32, 4, mesh.colors));
  }
  ANCHORSPLAT_RETURN_IF_ERROR(TakeTextures(file, mesh));
  if (textures.size() != colors.size() || flags.size() != colors.size()) {
    return Error{ErrorCode::kBadFile, Cat(path.string(), ": its lists of materials differ in length")};
  }
  for (size_t i = 0; i < colors.size(); ++i) {
    Material& m = mesh.materials.emplace_back();
    m.diffuse = {colors[i][0], colors[i][1], colors[i][2]};
    m.opacity = colors[i][3];
    m.texture = textures[i];
    m.two_sided = (flags[i] & 1) != 0;
    m.lit = (flags[i] & 2) != 0;
  }
  if (const Status status = Validate(mesh); !status.ok()) {
    return Error{ErrorCode::kBadFile, Cat(path.string(), ": ", status.error().message)};
  }
  return mesh;
}

}  // namespace anchorsplat
