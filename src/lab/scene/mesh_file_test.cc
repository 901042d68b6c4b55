#include "scene/mesh_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <limits>

#include "io/file_bytes_for_test.h"
#include "io/folder_for_test.h"
#include "scene/meshes_for_test.h"

namespace anchorsplat {
namespace {

Mesh Everything() {
  Mesh mesh = SquareAt(0, {0.1f, 0.2f, 0.3f});
  mesh.normals.assign(4, {0, 0, 1});
  mesh.colors.assign(4, {1, 0.5f, 0, 1});
  mesh.textures = {{"a", 2, 1, true, {1, 2, 3, 255, 5, 6, 7, 8}}, {"b", 1, 1, false, {9, 9, 9, 255}}};
  mesh.materials[0].texture = 1;
  mesh.materials[0].opacity = 0.75f;
  mesh.materials[0].two_sided = false;
  mesh.positions[3][1] = 1.0f / 3;
  return mesh;
}

TEST(MeshFile, ComesBackBitByBit) {
  for (const Mesh& mesh : {Everything(), SphereMesh(0.5f, 6, false)}) {
    const TestFolder folder;
    ASSERT_TRUE(WriteMeshFile(folder / "mesh.safetensors", mesh).ok());
    const auto back = ReadMeshFile(folder / "mesh.safetensors");
    ASSERT_TRUE(back.ok()) << back.error().message;
    EXPECT_EQ(back->positions, mesh.positions);
    EXPECT_EQ(back->normals, mesh.normals);
    EXPECT_EQ(back->uvs, mesh.uvs);
    EXPECT_EQ(back->colors, mesh.colors);
    EXPECT_EQ(back->triangles, mesh.triangles);
    EXPECT_EQ(back->triangle_materials, mesh.triangle_materials);
    ASSERT_EQ(back->textures.size(), mesh.textures.size());
    for (size_t i = 0; i < mesh.textures.size(); ++i) {
      EXPECT_EQ(back->textures[i].width, mesh.textures[i].width);
      EXPECT_EQ(back->textures[i].has_alpha, mesh.textures[i].has_alpha);
      EXPECT_EQ(back->textures[i].rgba, mesh.textures[i].rgba);
    }
    ASSERT_EQ(back->materials.size(), mesh.materials.size());
    EXPECT_EQ(back->materials[0].diffuse, mesh.materials[0].diffuse);
    EXPECT_EQ(back->materials[0].opacity, mesh.materials[0].opacity);
    EXPECT_EQ(back->materials[0].texture, mesh.materials[0].texture);
    EXPECT_EQ(back->materials[0].two_sided, mesh.materials[0].two_sided);
  }
}

TEST(MeshFile, DamageIsAnError) {
  const TestFolder folder;
  ASSERT_TRUE(WriteMeshFile(folder / "mesh.safetensors", Everything()).ok());
  const std::string bytes = FileBytes(folder / "mesh.safetensors");
  const auto damaged = [&](const std::string& from, const std::string& to) {
    std::string changed = bytes;
    const size_t at = changed.find(from);
    EXPECT_NE(at, std::string::npos);
    changed.replace(at, from.size(), to);
    std::ofstream(folder / "damaged.safetensors", std::ios::binary) << changed;
    const auto mesh = ReadMeshFile(folder / "damaged.safetensors");
    return !mesh.ok() && mesh.error().code == ErrorCode::kBadFile;
  };
  EXPECT_TRUE(damaged("positions", "posituons"));
  EXPECT_TRUE(damaged("\"U32\"", "\"F32\""));
  EXPECT_TRUE(damaged("[2,3]", "[3,2]"));
  std::ofstream(folder / "short.safetensors", std::ios::binary) << bytes.substr(0, bytes.size() - 1);
  EXPECT_FALSE(ReadMeshFile(folder / "short.safetensors").ok());
  EXPECT_FALSE(ReadMeshFile(folder / "none.safetensors").ok());
  Mesh invalid = Everything();
  invalid.triangles[0][0] = 99;
  EXPECT_FALSE(WriteMeshFile(folder / "invalid.safetensors", invalid).ok());
}

}  // namespace
}  // namespace anchorsplat
