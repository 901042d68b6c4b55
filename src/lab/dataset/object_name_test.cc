#include "dataset/object_name.h"

#include <gtest/gtest.h>

#include "scene/mesh.h"

namespace anchorsplat {
namespace {

TEST(ObjectName, IsASafeFolderName) {
  EXPECT_EQ(ObjectName("models/chair.obj"), "chair");
  EXPECT_EQ(ObjectName("my models/red chair (2).glb"), "red_chair__2_");
  EXPECT_EQ(ObjectName("/data/BlendSwap-CC-0.sh3f#barrel"), "BlendSwap-CC-0-barrel");
  EXPECT_EQ(ObjectName("..obj").find('/'), std::string::npos);
  EXPECT_NE(ObjectName("x/.hidden.obj").front(), '.');
}

TEST(ObjectName, LeavesTheDataSetsOwnFilesAlone) {
  for (const std::string name : {"manifest.jsonl", "failures.jsonl", "splits.json", "lock", "chair.job", "chair.log",
                                 "chair.lock", "chair.replaced", "Manifest.JSONL"}) {
    EXPECT_EQ(ObjectName("models/" + name + ".obj"), name + "-object");
  }
  EXPECT_EQ(ObjectName("models/.building.obj"), "building");
  EXPECT_EQ(ObjectName("models/manifest.obj"), "manifest");
}

TEST(ObjectName, KeepsTheDotsOfALibrarysKeys) {
  EXPECT_EQ(ObjectName("lib.sh3f#chair.v1"), "lib-chair.v1");
  EXPECT_NE(ObjectName("lib.sh3f#chair.v1"), ObjectName("lib.sh3f#chair.v2"));
  EXPECT_EQ(ObjectName("lib.sh3f#parts/chair.obj"), "lib-chair");
  EXPECT_EQ(ObjectName("scans/room.v1"), "room.v1");  // a folder of pictures
}

TEST(ObjectName, VariantsShareAStem) {
  for (const char* name :
       {"sofa", "sofa2", "Sofa_red", "sofa-left", "sofaBlack", "SOFA 03", "sofa_large_2", "sofa.10"}) {
    EXPECT_EQ(VariantStem(name), "sofa") << name;
  }
  EXPECT_NE(VariantStem("sofa"), VariantStem("softball"));
  EXPECT_EQ(VariantStem("red"), "red");  // the whole name is no ending
  EXPECT_EQ(VariantStem("7"), "7");
  EXPECT_EQ(VariantStem(""), "");
}

TEST(ObjectName, HashesAreTheSameEverywhere) {
  EXPECT_EQ(StableHash("chair"), StableHash("chair"));
  EXPECT_NE(StableHash("chair"), StableHash("chair", 1));
  EXPECT_NE(StableHash("chair1"), StableHash("chair2"));
}

TEST(ObjectName, RecolouringsShareAFingerprint) {
  Mesh mesh;
  mesh.materials.resize(1);
  mesh.positions = {{-0.5f, 0, 0}, {0.5f, 0, 0}, {0, 0.3f, 0}};
  mesh.triangles = {{0, 1, 2}};
  mesh.triangle_materials = {0};
  Mesh red = mesh;
  red.materials[0].diffuse = {1, 0, 0};
  EXPECT_EQ(MeshFingerprint(mesh), MeshFingerprint(red));
  red.positions[2][1] = 0.4f;
  EXPECT_NE(MeshFingerprint(mesh), MeshFingerprint(red));
}

}  // namespace
}  // namespace anchorsplat
