#include "scene/raw_scene.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <string>

namespace anchorsplat {
namespace {

RawScene Example() {
  RawScene scene;
  scene.corners.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  scene.corners.normals.assign(3, {0, 0, 1});
  scene.corners.uvs.assign(3, {0.5f, 0.25f});
  scene.corners.has_uvs = true;
  scene.corners.materials = {1};
  scene.materials.resize(2);
  scene.materials[1] = {"paint", true, {1, 0.5f, 0}, 0.75f, false, true, "a.png", "b.png"};
  scene.pictures = {{"inside", 1, 2, std::string(8, 'x')}, {"file", 9, 0, "bytes"}};
  scene.degenerate = 3;
  scene.not_triangles = 5;
  scene.has_normals = true;
  return scene;
}

TEST(RawScene, SurvivesPacking) {
  const RawScene scene = Example();
  const auto back = Unpack(Pack(scene));
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(Pack(*back), Pack(scene));
  EXPECT_EQ(back->corners.positions, scene.corners.positions);
  EXPECT_EQ(back->materials[1].picture, "a.png");
  EXPECT_EQ(back->materials[1].opacity, 0.75f);
  EXPECT_EQ(back->pictures[1].bytes, "bytes");
  EXPECT_EQ(back->degenerate, 3);
}

TEST(RawScene, EveryCutIsNoticed) {
  const std::string packed = Pack(Example());
  for (size_t size = 0; size < packed.size(); ++size) EXPECT_FALSE(Unpack(packed.substr(0, size)).ok()) << size;
  EXPECT_FALSE(Unpack(packed + "x").ok());
}

TEST(RawScene, ADamagedByteIsRejectedOrLeavesAValidScene) {
  const std::string packed = Pack(Example());
  int64_t rejected = 0, accepted = 0;
  for (size_t i = 0; i < packed.size(); ++i) {
    for (const char c : {'\x00', '\x01', '\x7f', '\xff'}) {
      std::string damaged = packed;
      damaged[i] = c;
      const auto scene = Unpack(damaged);
      ++(scene.ok() ? accepted : rejected);
      if (scene.ok()) {
        EXPECT_TRUE(Unpack(Pack(*scene)).ok()) << "byte " << i;
      }
    }
  }
  EXPECT_GT(rejected, 0);
  EXPECT_GT(accepted, 0);
}

TEST(RawScene, BrokenPromisesAreErrors) {
  const auto refused = [](void (*change)(RawScene&)) {
    RawScene scene = Example();
    change(scene);
    return !Unpack(Pack(scene)).ok();
  };
  EXPECT_TRUE(refused([](RawScene& s) { s.corners.materials[0] = 2; }));
  EXPECT_TRUE(refused([](RawScene& s) { s.corners.materials[0] = -1; }));
  EXPECT_TRUE(refused([](RawScene& s) { s.corners.positions.pop_back(); }));
  EXPECT_TRUE(refused([](RawScene& s) { s.corners.uvs.pop_back(); }));
  EXPECT_TRUE(refused([](RawScene& s) { s.corners.has_uvs = false; }));
  EXPECT_TRUE(refused([](RawScene& s) { s.corners.positions[1][1] = std::numeric_limits<float>::quiet_NaN(); }));
  EXPECT_TRUE(refused([](RawScene& s) { s.pictures[0].height = 3; }));
  EXPECT_TRUE(refused([](RawScene& s) { s.materials.clear(); }));
}

}  // namespace
}  // namespace anchorsplat
