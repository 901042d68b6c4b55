#include "scene/mesh.h"

#include <gtest/gtest.h>

#include <limits>

#include "scene/meshes_for_test.h"

namespace anchorsplat {
namespace {

TEST(Mesh, NormalizedBoxIsCentredWithLongestSideOne) {
  Mesh mesh = SquareAt(3, {1, 1, 1});
  for (auto& p : mesh.positions) p = {40 * p[0] + 7, 10 * p[1] - 100, p[2] + 5};
  mesh.positions.push_back({1e6f, 1e6f, 1e6f});  // used by no triangle
  mesh.uvs.push_back({0, 0});
  auto out = NormalizedToUnitCube(mesh);
  ASSERT_TRUE(out.ok());
  EXPECT_EQ(out->positions[0], (std::array<float, 3>{-0.5f, -0.125f, 0}));
  EXPECT_EQ(out->positions[2], (std::array<float, 3>{0.5f, 0.125f, 0}));
}

TEST(Mesh, NothingToNormalizeIsAnError) {
  EXPECT_FALSE(NormalizedToUnitCube(Mesh()).ok());
  Mesh point;
  point.positions = {{1, 2, 3}};
  point.triangles = {{0, 0, 0}};
  EXPECT_FALSE(NormalizedToUnitCube(point).ok());
  point.positions[0][1] = std::numeric_limits<float>::infinity();
  EXPECT_FALSE(NormalizedToUnitCube(point).ok());
}

TEST(Mesh, DropsWhatCannotBeSeen) {
  Mesh mesh = SquareAt(0, {1, 1, 1});
  Material glass;
  glass.opacity = 0.29f;
  mesh.materials.push_back(glass);
  AddQuad(mesh, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}, 1);
  mesh.positions.push_back({std::numeric_limits<float>::quiet_NaN(), 0, 0});
  mesh.uvs.push_back({0, 0});
  mesh.triangles.push_back({0, 1, 8});
  mesh.triangles.push_back({0, 1, 1});
  mesh.triangle_materials.insert(mesh.triangle_materials.end(), {0, 0});
  ASSERT_TRUE(Validate(mesh).ok());
  const DroppedTriangles dropped = DropInvisibleTriangles(mesh);
  EXPECT_EQ(dropped.transparent, 2);
  EXPECT_EQ(dropped.not_finite, 1);
  EXPECT_EQ(dropped.degenerate, 1);
  EXPECT_EQ(mesh.triangles.size(), 2u);
  EXPECT_TRUE(Validate(mesh).ok());
}

TEST(Mesh, ValidateFindsEveryKindOfMistake) {
  const Mesh good = SquareAt(0, {1, 1, 1});
  EXPECT_TRUE(Validate(good).ok());
  const auto broken = [&](auto change) {
    Mesh mesh = good;
    change(mesh);
    return !Validate(mesh).ok();
  };
  EXPECT_TRUE(broken([](Mesh& m) { m.triangles[1][2] = 4; }));
  EXPECT_TRUE(broken([](Mesh& m) { m.triangle_materials[0] = 1; }));
  EXPECT_TRUE(broken([](Mesh& m) { m.triangle_materials[0] = -1; }));
  EXPECT_TRUE(broken([](Mesh& m) { m.triangle_materials.pop_back(); }));
  EXPECT_TRUE(broken([](Mesh& m) { m.normals.resize(3); }));
  EXPECT_TRUE(broken([](Mesh& m) { m.uvs.resize(3); }));
  EXPECT_TRUE(broken([](Mesh& m) { m.colors.resize(5); }));
  EXPECT_TRUE(broken([](Mesh& m) { m.materials[0].texture = 0; }));
  EXPECT_TRUE(broken([](Mesh& m) { m.materials[0].texture = -2; }));
  EXPECT_TRUE(broken([](Mesh& m) { m.textures = {{"t", 2, 2, false, std::vector<uint8_t>(15)}}; }));
  EXPECT_TRUE(broken([](Mesh& m) { m.textures = {{"t", 0, 2, false, {}}}; }));
}

}  // namespace
}  // namespace anchorsplat
