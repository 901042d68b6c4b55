#include "cameras/bundler_cameras.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "cameras/camera_io.h"
#include "cameras/rig_for_test.h"
#include "core/messages_for_test.h"
#include "core/text.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

// What Bundler has no word for is left out of the lens.
std::vector<Camera> BundlerRig(int count) {
  std::vector<Camera> rig = RigForTest(count);
  for (Camera& camera : rig) {
    camera.photograph.lens = {.model = LensModel::kRadial, .radial = {-0.1, 0.02, 0, 0}};
    camera.photograph.intrinsics.cx = 32;
    camera.photograph.intrinsics.cy = 24;
  }
  return rig;
}

std::string BundleOf(const std::vector<Camera>& rig) {
  std::string text = Cat("# Bundle file v0.3\n", rig.size(), " 1\n");
  for (const Camera& camera : rig) {
    const auto& r = camera.world_to_camera.rotation;
    const auto& t = camera.world_to_camera.translation;
    text += "70 -0.1 0.02\n" + Digits(std::array{r[0], r[1], r[2]}) + "\n" + Digits(std::array{-r[3], -r[4], -r[5]}) +
            "\n" + Digits(std::array{-r[6], -r[7], -r[8]}) + "\n" + Digits(std::array{t[0], -t[1], -t[2]}) + "\n";
  }
  return text + "0.1 0.2 0.3\n255 0 0\n1 0 17 3.5 -2.25\n";
}

// Bundler's own words: P = R·X + t, p = −P/P.z, x right and y up from the picture's middle.
TEST(Bundler, DrawsAPointWhereItsManualSays) {
  const TestFolder folder;
  const auto rig = BundlerRig(3);
  WritePicturesOf(rig, folder.path());
  WriteText(folder / "bundle.out", BundleOf(rig));
  WriteText(folder / "list.txt", "./a.png 0 1234.5\r\nb.png\n\nc.png 0 99\n");
  for (const auto& path : {folder / "bundle.out", folder.path()}) {
    const auto set = ReadCameras(path);
    ASSERT_TRUE(set.ok()) << set.error().message;
    ExpectSamePixels(set->cameras, rig);
    EXPECT_EQ(set->cameras[2].image, folder / "c.png");
    const auto& r = rig[0].world_to_camera.rotation;
    const auto& t = rig[0].world_to_camera.translation;
    const std::array<double, 3> x = {0.2, 0.1, -0.3};
    const double px = r[0] * x[0] + r[1] * x[1] + r[2] * x[2] + t[0];
    const double py = -(r[3] * x[0] + r[4] * x[1] + r[5] * x[2] + t[1]);
    const double pz = -(r[6] * x[0] + r[7] * x[1] + r[8] * x[2] + t[2]);
    const double u = -px / pz, v = -py / pz, q = u * u + v * v, s = 70 * (1 - 0.1 * q + 0.02 * q * q);
    EXPECT_NEAR(PixelOf(set->cameras[0], x)[0], 32 + s * u, 1e-9);
    EXPECT_NEAR(PixelOf(set->cameras[0], x)[1], 24 - s * v, 1e-9);
  }
}

TEST(Bundler, ListsOfOtherPrograms) {
  const auto rig = BundlerRig(2);
  const std::pair<const char*, const char*> places[] = {{"scan.bundle.out", "scan.list.txt"},
                                                        {"scan.out", "scan-list.txt"},
                                                        {"scan.out", "list.txt"},
                                                        {"bundle/bundle.out", "list.txt"}};
  for (const auto& [bundle, list] : places) {
    const TestFolder folder;
    WritePicturesOf(rig, folder / "images");
    WriteText(folder / bundle, BundleOf(rig));
    auto set = ReadCameras(folder / bundle);
    ASSERT_FALSE(set.ok());
    EXPECT_EQ(set.error().code, ErrorCode::kNotFound);
    EXPECT_NE(set.error().message.find("picture list not found"), std::string::npos) << set.error().message;
    WriteText(folder / list, "images/a.png\nb.png\n");
    for (const auto& path : {folder / bundle, folder.path()}) {
      set = ReadCameras(path);
      ASSERT_TRUE(set.ok()) << set.error().message;
      ASSERT_EQ(set->cameras.size(), 2u);
      EXPECT_EQ(set->cameras[0].name, "images/a");
      EXPECT_EQ(set->cameras[0].image, folder / "images/a.png");
      ExpectSamePixels({set->cameras[1]}, {rig[1]});
    }
  }
}

TEST(Bundler, WhatIsLeftOutIsCounted) {
  const TestFolder folder;
  const auto rig = BundlerRig(3);
  WritePicturesOf({rig[0]}, folder.path());
  std::string text = BundleOf(rig);
  text.replace(text.rfind("70 -0.1 0.02"), 12, "0 0 0");
  WriteText(folder / "bundle.out", text);
  WriteText(folder / "list.txt", "a.png\nb.png\nc.png\n");
  const Messages messages;
  auto set = ReadCameras(folder.path());
  ASSERT_TRUE(set.ok()) << set.error().message;
  ExpectSamePixels(set->cameras, {rig[0]});
  ASSERT_EQ(messages.notes().size(), 1u);
  EXPECT_NE(messages.notes()[0].find("1 of 3 cameras skipped: not registered"), std::string::npos)
      << messages.notes()[0];
  ASSERT_EQ(messages.warnings().size(), 1u);
  EXPECT_NE(messages.warnings()[0].find("1 of 2 cameras skipped"), std::string::npos) << messages.warnings()[0];
  std::filesystem::remove(folder / "a.png");
  set = ReadCameras(folder.path());
  ASSERT_FALSE(set.ok());
  EXPECT_EQ(set.error().code, ErrorCode::kNotFound);
  EXPECT_NE(set.error().message.find((folder / "images/a.png").string()), std::string::npos) << set.error().message;
}

TEST(Bundler, MalformedFilesSayWhatIsWrong) {
  const TestFolder folder;
  const auto rig = BundlerRig(1);
  WritePicturesOf(rig, folder.path());
  const std::string good = BundleOf(rig), list = "a.png\n";
  const auto read = [&](const std::string& text, const std::string& names) {
    WriteText(folder / "bundle.out", text);
    WriteText(folder / "list.txt", names);
    return ReadCameras(folder / "bundle.out");
  };
  ASSERT_TRUE(read(good, list).ok());
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    return text.replace(text.find(from), from.size(), to);
  };
  const std::pair<std::pair<std::string, std::string>, const char*> cases[] = {
      {{changed("v0.3", "v0.1"), list}, "line 1: expected \"# Bundle file v0.3\""},
      {{changed("\n1 1\n", "\n99999999999999 1\n"), list}, "has too few bytes for"},
      {{changed("\n1 1\n", "\n-1 1\n"), list}, "line 2: expected the number of cameras"},
      {{changed("70 -0.1", "nan -0.1"), list}, "line 3: expected a focal length, found \"nan\""},
      {{changed("70 -0.1", "-70 -0.1"), list}, "focal length -70"},
      {{changed("70 -0.1", "70 -50"), list}, "camera 0 (a.png): lens distortion (k1 = -50"},
      {{changed("70 -0.1 0.02\n", "70 -0.1 0.02\n9 "), list}, "not a rotation"},
      {{good.substr(0, 60), list}, "ends before"},
      {{good, "a.png\nb.png\n"}, "lists 2 pictures"},
      {{good, ""}, "lists 0 pictures"},
      {{good, std::string("a\0b\n", 4)}, "not a picture path"},
      {{changed("70 -0.1 0.02", "0 0 0"), list}, "no camera is registered"},
  };
  for (const auto& [texts, expected] : cases) {
    const auto set = read(texts.first, texts.second);
    ASSERT_FALSE(set.ok()) << expected;
    EXPECT_EQ(set.error().code, ErrorCode::kBadFile);
    EXPECT_NE(set.error().message.find(expected), std::string::npos) << expected << "\n" << set.error().message;
  }
}

}  // namespace
}  // namespace anchorsplat
