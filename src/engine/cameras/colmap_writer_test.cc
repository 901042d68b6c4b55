#include "cameras/colmap_writer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

#include "cameras/camera_io.h"
#include "core/random.h"
#include "core/rotation.h"
#include "io/file_bytes_for_test.h"
#include "io/folder_for_test.h"
#include "io/little_endian.h"

namespace anchorsplat {
namespace {

CameraSet RandomCameras(int count) {
  Random random(11);
  CameraSet set;
  for (int i = 0; i < count; ++i) {
    Camera camera;
    camera.name = "view " + std::to_string(i);  // spaces are legal
    camera.intrinsics = {320, 240, 300.25 + i % 2, 1.0 / 3, 160.5, 119};
    camera.world_to_camera.rotation =
        RotationFromQuaternion(random.Normal(), random.Normal(), random.Normal(), random.Normal());
    for (double& x : camera.world_to_camera.translation) x = 10 * random.Normal();
    set.cameras.push_back(camera);
  }
  return set;
}

TEST(ColmapWriter, BothFormsComeBackAsTheyWere) {
  const CameraSet set = RandomCameras(9);
  for (const ColmapForm form : {ColmapForm::kBinary, ColmapForm::kText}) {
    const TestFolder folder;
    ASSERT_TRUE(WriteColmapCameras(folder.path(), set, form).ok());
    const auto back = ReadCameras(folder.path());
    ASSERT_TRUE(back.ok()) << back.error().message;
    ASSERT_EQ(back->cameras.size(), 9u);
    for (size_t i = 0; i < 9; ++i) {
      const Camera &a = set.cameras[i], &b = back->cameras[i];
      EXPECT_EQ(a.name, b.name);
      EXPECT_EQ(a.intrinsics.width, b.intrinsics.width);
      EXPECT_EQ(a.intrinsics.height, b.intrinsics.height);
      EXPECT_EQ(a.intrinsics.fx, b.intrinsics.fx);
      EXPECT_EQ(a.intrinsics.fy, b.intrinsics.fy);
      EXPECT_EQ(a.intrinsics.cx, b.intrinsics.cx);
      EXPECT_EQ(a.world_to_camera.translation, b.world_to_camera.translation);
      for (size_t k = 0; k < 9; ++k) {  // through a quaternion
        EXPECT_NEAR(a.world_to_camera.rotation[k], b.world_to_camera.rotation[k], 1e-12);
      }
    }
  }
}

TEST(ColmapWriter, SameIntrinsicsShareACamera) {
  const TestFolder folder;
  CameraSet set = RandomCameras(9);
  for (Camera& camera : set.cameras) camera.intrinsics = set.cameras[0].intrinsics;
  ASSERT_TRUE(WriteColmapCameras(folder.path(), set, ColmapForm::kBinary).ok());
  EXPECT_EQ(std::filesystem::file_size(folder / "cameras.bin"), 8u + 4 + 4 + 8 + 8 + 4 * 8);
}

TEST(ColmapWriter, PointsFollowTheFormat) {
  const TestFolder folder;
  const std::vector<ColmapPoint> points = {{{1, 2, 3}, {10, 20, 30}}, {{-0.5, 0, 1e-3}, {255, 0, 1}}};
  ASSERT_TRUE(WriteColmapPoints(folder.path(), points, ColmapForm::kBinary).ok());
  const std::string bytes = FileBytes(folder / "points3D.bin");
  ASSERT_EQ(bytes.size(), 8u + 2 * 51);
  EXPECT_EQ(LoadLittleEndian<uint64_t>(bytes.data()), 2u);
  EXPECT_EQ(LoadLittleEndian<uint64_t>(bytes.data() + 8), 1u);
  EXPECT_EQ(LoadLittleEndian<double>(bytes.data() + 32), 3.0);
  EXPECT_EQ(static_cast<uint8_t>(bytes[8 + 51 + 32]), 255);

  ASSERT_TRUE(WriteColmapPoints(folder.path(), points, ColmapForm::kText).ok());
  std::ifstream text(folder / "points3D.txt");
  std::string line, last;
  while (std::getline(text, line)) last = line;
  EXPECT_EQ(last, "2 -0.5 0 0.001 255 0 1 0");
}

TEST(ColmapWriter, RefusesWhatTheFormatCannotHold) {
  const TestFolder folder;
  const auto refused = [&](auto change) {
    CameraSet set = RandomCameras(2);
    change(set.cameras[1]);
    const Status status = WriteColmapCameras(folder.path(), set, ColmapForm::kText);
    return !status.ok() && status.error().code == ErrorCode::kBadArgument && folder.Entries() == 0;
  };
  EXPECT_TRUE(refused([](Camera& c) { c.name = ""; }));
  EXPECT_TRUE(refused([](Camera& c) { c.name = "a\nb"; }));
  EXPECT_TRUE(refused([](Camera& c) { c.name = std::string("a\0b", 3); }));
  EXPECT_TRUE(refused([](Camera& c) { c.intrinsics.fx = 0; }));
  EXPECT_TRUE(refused([](Camera& c) { c.world_to_camera.rotation[4] = std::nan(""); }));
  EXPECT_TRUE(refused([](Camera& c) { c.world_to_camera.translation[0] = std::numeric_limits<double>::infinity(); }));
  EXPECT_FALSE(WriteColmapCameras(folder.path(), CameraSet{}, ColmapForm::kBinary).ok());
  const std::vector<ColmapPoint> nowhere = {{{std::nan(""), 0, 0}, {0, 0, 0}}};
  EXPECT_FALSE(WriteColmapPoints(folder.path(), nowhere, ColmapForm::kBinary).ok());
}

TEST(ColmapWriter, ReplacesOnlyWhenTold) {
  const TestFolder folder;
  const CameraSet set = RandomCameras(2);
  ASSERT_TRUE(WriteColmapCameras(folder.path(), set, ColmapForm::kText).ok());
  EXPECT_EQ(WriteColmapCameras(folder.path(), set, ColmapForm::kText).error().code, ErrorCode::kExists);
  EXPECT_TRUE(WriteColmapCameras(folder.path(), set, ColmapForm::kText, {.overwrite = true}).ok());
}

}  // namespace
}  // namespace anchorsplat
