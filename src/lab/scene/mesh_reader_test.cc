#include "scene/mesh_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "images/image_io.h"
#include "io/folder_for_test.h"
#include "scene/mesh_summary.h"

namespace anchorsplat {
namespace {

using ::testing::IsEmpty;

TEST(MeshReader, ReadsAFileWithWhatLiesAroundIt) {
  TestFolder folder;
  std::filesystem::create_directories(folder / "textures");
  std::filesystem::create_directories(folder / "models");
  std::ofstream(folder / "models/Box.OBJ")
      << "mtllib box.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl m\nf 1/1 2/1 3/1\n";
  std::ofstream(folder / "models/BOX.MTL") << "newmtl m\nmap_Kd ..\\textures\\wood%20dark.PNG\n";
  ASSERT_TRUE(WritePng(folder / "textures/wood dark.png", Image(2, 2, 3)).ok());
  std::ofstream(folder / "models/LICENSE.txt") << "Creative Commons Attribution 4.0";
  const auto mesh = ReadMesh((folder / "models/Box.OBJ").string());
  ASSERT_TRUE(mesh.ok()) << mesh.error().message;
  EXPECT_THAT(mesh->warnings, IsEmpty());
  EXPECT_EQ(mesh->mesh.textures.size(), 1u);
  EXPECT_EQ(mesh->origin.name, "Box");
  EXPECT_EQ(mesh->origin.licence, "CC-BY-4.0");
  EXPECT_EQ(mesh->origin.licence_source, "LICENSE.txt");
}

TEST(MeshReader, LicenceFilesNeedNoEnding) {
  TestFolder folder;
  std::ofstream(folder / "box.obj") << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  const std::string box = (folder / "box.obj").string();
  EXPECT_EQ(ReadMesh(box)->origin.licence, "");
  std::filesystem::create_directories(folder / "licences");
  std::ofstream(folder / "LICENSE") << "Do what the author would have liked.";
  EXPECT_EQ(ReadMesh(box)->origin.licence, "licence not recognised, see LICENSE");
  EXPECT_EQ(ReadMesh(box)->origin.licence_source, "LICENSE");
  std::ofstream(folder / "COPYING") << "GNU GENERAL PUBLIC LICENSE\n   Version 2, June 1991\n";
  EXPECT_EQ(ReadMesh(box)->origin.licence, "GPL-2.0");
  EXPECT_EQ(ReadMesh(box)->origin.licence_source, "COPYING");
}

TEST(MeshReader, FilesFarFromTheMeshAreNotRead) {
  TestFolder folder;
  std::filesystem::create_directories(folder / "a/b/models");
  std::ofstream(folder / "secret.mtl") << "newmtl m\nKd 1 0 0\nmap_Kd ../../secret.png\n";
  std::ofstream(folder / "a/b/near.mtl") << "newmtl n\nKd 0 1 0\nmap_Kd x/../../../far.png\n";
  ASSERT_TRUE(WritePng(folder / "a/far.png", Image(2, 2, 3)).ok());
  std::ofstream(folder / "a/b/models/box.obj") << "mtllib ../../../secret.mtl\nmtllib ../near.mtl\nv 0 0 0\nv 1 0 0\n"
                                                  "v 0 1 0\nv 1 1 0\nusemtl m\nf 1 2 3\nusemtl n\nf 2 4 3\n";
  const auto mesh = ReadMesh((folder / "a/b/models/box.obj").string());
  ASSERT_TRUE(mesh.ok()) << mesh.error().message;
  const std::string all = ::testing::PrintToString(mesh->warnings);
  EXPECT_EQ(mesh->warnings.size(), 3u) << all;
  EXPECT_NE(all.find("material library \\\"../../../secret.mtl\\\" is not looked for"), std::string::npos) << all;
  EXPECT_NE(all.find("material \\\"m\\\" is in no material library"), std::string::npos) << all;
  EXPECT_NE(all.find("x/../../../far.png is not looked for"), std::string::npos) << all;
  EXPECT_TRUE(mesh->mesh.textures.empty());
}

TEST(MeshReader, NoFileNoMesh) {
  TestFolder folder;
  EXPECT_EQ(ReadMesh((folder / "a.obj").string()).error().code, ErrorCode::kNotFound);
  std::filesystem::create_directories(folder / "b.obj");
  EXPECT_EQ(ReadMesh((folder / "b.obj").string()).error().code, ErrorCode::kNotFound);
}

TEST(MeshReader, ShortNames) {
  EXPECT_EQ(MeshShortName("models/barrel.obj"), "barrel");
  EXPECT_EQ(MeshShortName("a.sh3f#barrel"), "barrel");
  EXPECT_EQ(MeshShortName("a.sh3f#lib/barrel/barrel.obj"), "barrel");
  EXPECT_EQ(MeshShortName("a.sh3f#chair.v2"), "chair.v2");
  EXPECT_EQ(MeshShortName("lib/a.b.SH3F"), "a.b");
  EXPECT_TRUE(IsMeshAddress("A.SH3F#x"));
  EXPECT_TRUE(IsMeshAddress("a.GLB"));
  EXPECT_FALSE(IsMeshAddress("a.splat"));
  EXPECT_TRUE(IsMeshLibrary("a.sh3f"));
  EXPECT_FALSE(IsMeshLibrary("a.sh3f#x"));
}

Mesh Box(float x, float y, float z, float scale) {
  Mesh mesh;
  for (int k = 0; k < 8; ++k) {
    mesh.positions.push_back({k & 1 ? x * scale : 0, k & 2 ? y * scale : 0, k & 4 ? z * scale : 0});
  }
  mesh.triangles = {{0, 1, 3}, {0, 3, 2}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 3, 7}, {2, 7, 6}, {0, 2, 6}, {0, 6, 4}, {1, 3, 7}, {1, 7, 5}};
  mesh.triangle_materials.assign(12, 0);
  mesh.materials.emplace_back();
  return mesh;
}

float Difference(const MeshSummary& a, const MeshSummary& b) {
  float sum = 0;
  for (size_t k = 0; k < a.shape.size(); ++k) sum += std::abs(a.shape[k] - b.shape[k]);
  return sum;
}

TEST(MeshSummary, CountsWhatCanBeSeen) {
  Mesh mesh = Box(1, 2, 3, 1);
  mesh.materials.emplace_back().opacity = 0.1f;
  mesh.materials.emplace_back().diffuse = {1, 0, 0};
  mesh.materials.emplace_back().texture = 0;
  mesh.textures.push_back({"t", 1, 1, false, {0, 0, 0, 255}});
  mesh.triangle_materials[0] = 1;
  mesh.triangle_materials[1] = 2;
  mesh.triangle_materials[2] = 3;
  const MeshSummary summary = Summarize(mesh);
  EXPECT_EQ(summary.triangles, 11);
  EXPECT_EQ(summary.vertices, 8);
  EXPECT_EQ(summary.materials, 3);
  EXPECT_EQ(summary.textures, 1);
  EXPECT_EQ(summary.colors, 2);
  EXPECT_EQ(summary.high[2], 3);
  EXPECT_EQ(Summarize(Mesh()).triangles, 0);
}

TEST(MeshSummary, TheShapeForgetsSizeAndTurningAndKnowsProportions) {
  const MeshSummary box = Summarize(Box(1, 2, 3, 1));
  EXPECT_LT(Difference(box, Summarize(Box(1, 2, 3, 100))), 1e-3);
  EXPECT_LT(Difference(box, Summarize(Box(3, 1, 2, 0.01f))), 0.06);  // other triangles, so other random points
  EXPECT_GT(Difference(box, Summarize(Box(1, 2, 6, 1))), 0.15);
}

}  // namespace
}  // namespace anchorsplat
