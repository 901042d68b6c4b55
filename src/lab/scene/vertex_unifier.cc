#include "scene/vertex_unifier.h"

#include <bit>
#include <cstddef>
#include <unordered_map>
#include <utility>

namespace anchorsplat {

namespace {

using Key = std::array<uint32_t, 12>;

struct KeyHash {
  size_t operator()(const Key& key) const {
    uint64_t hash = 0x9e3779b97f4a7c15;
    for (const uint32_t word : key) {  // splitmix64's finaliser per word
      hash ^= word;
      hash = (hash ^ (hash >> 30)) * 0xbf58476d1ce4e5b9;
      hash = (hash ^ (hash >> 27)) * 0x94d049bb133111eb;
      hash ^= hash >> 31;
    }
    return static_cast<size_t>(hash);
  }
};

}  // namespace

Mesh UnifyVertices(const MeshCorners& corners) {
  Mesh mesh;
  std::unordered_map<Key, uint32_t, KeyHash> known;
  known.reserve(corners.positions.size() / 2);
  mesh.triangles.resize(corners.materials.size());
  for (size_t i = 0; i < corners.positions.size(); ++i) {
    Key key{};
    size_t at = 0;
    const auto put = [&](const auto& values) {
      for (const float v : values) key[at++] = std::bit_cast<uint32_t>(v);
    };
    put(corners.positions[i]);
    put(corners.normals[i]);
    if (corners.has_uvs) put(corners.uvs[i]);
    if (corners.has_colors) put(corners.colors[i]);
    const auto [entry, is_new] = known.try_emplace(key, static_cast<uint32_t>(mesh.positions.size()));
    if (is_new) {
      mesh.positions.push_back(corners.positions[i]);
      mesh.normals.push_back(corners.normals[i]);
      if (corners.has_uvs) mesh.uvs.push_back(corners.uvs[i]);
      if (corners.has_colors) mesh.colors.push_back(corners.colors[i]);
    }
    mesh.triangles[i / 3][i % 3] = entry->second;
  }
  mesh.triangle_materials = corners.materials;
  return mesh;
}

void RemoveUnusedMaterials(Mesh& mesh) {
  std::vector<int32_t> new_material(mesh.materials.size(), -1);
  for (const int32_t m : mesh.triangle_materials) new_material[static_cast<size_t>(m)] = 0;
  std::vector<Material> materials;
  for (size_t m = 0; m < new_material.size(); ++m) {
    if (new_material[m] < 0) continue;
    new_material[m] = static_cast<int32_t>(materials.size());
    materials.push_back(std::move(mesh.materials[m]));
  }
  for (int32_t& m : mesh.triangle_materials) m = new_material[static_cast<size_t>(m)];
  std::vector<int> new_texture(mesh.textures.size(), -1);
  for (const Material& material : materials) {
    if (material.texture >= 0) new_texture[static_cast<size_t>(material.texture)] = 0;
  }
  std::vector<Texture> textures;
  for (size_t t = 0; t < new_texture.size(); ++t) {
    if (new_texture[t] < 0) continue;
    new_texture[t] = static_cast<int>(textures.size());
    textures.push_back(std::move(mesh.textures[t]));
  }
  for (Material& material : materials) {
    if (material.texture >= 0) material.texture = new_texture[static_cast<size_t>(material.texture)];
  }
  mesh.materials = std::move(materials);
  mesh.textures = std::move(textures);
}

}  // namespace anchorsplat
