#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>
#include <tuple>
#include <utility>

#include "cameras/camera_io.h"
#include "core/source_dir_for_test.h"
#include "images/image_io.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

const char kIdentity[] = R"("transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]])";

Result<CameraSet> ReadText(const TestFolder& folder, const std::string& text) {
  std::filesystem::remove(folder / "transforms.json");  // some file systems flush a file that is emptied and rewritten
  std::ofstream(folder / "transforms.json", std::ios::trunc) << text;
  return ReadCameras(folder / "transforms.json");
}

std::string OneFrame(const std::string& head, const std::string& frame = "") {
  return "{" + head + (head.empty() ? "" : ",") + R"("frames": [{"file_path": "a.png",)" + frame +
         (frame.empty() ? "" : ",") + kIdentity + "}]}";
}

TEST(TransformsJson, ReadsTheExamples) {
  for (const std::string scene : {"biplane", "stone_lantern"}) {
    const std::filesystem::path folder = SourceDirForTest() / "examples" / scene;
    for (const auto& [file, count, size] :
         {std::tuple("transforms_lr.json", 127u, 256), {"transforms_hr.json", 10u, 1024}}) {
      const auto set = ReadCameras(folder / file);
      ASSERT_TRUE(set.ok()) << set.error().message;
      ASSERT_EQ(set->cameras.size(), count);
      ASSERT_TRUE(set->background.has_value());
      EXPECT_EQ(*set->background, (std::array<float, 3>{0, 0, 0}));
      for (const Camera& camera : set->cameras) {
        EXPECT_EQ(camera.intrinsics.width, size);
        EXPECT_EQ(camera.intrinsics.height, size);
        EXPECT_NEAR(camera.intrinsics.fx, 0.5 * size / std::tan(std::numbers::pi / 8), 1e-9);
        EXPECT_EQ(camera.intrinsics.fy, camera.intrinsics.fx);
        EXPECT_EQ(camera.intrinsics.cx, 0.5 * size);
        // The rig stands on a sphere of radius 1.7 and looks at the origin.
        const auto center = camera.Center();
        EXPECT_NEAR(std::hypot(center[0], center[1], center[2]), 1.7, 1e-6);
        const auto origin = camera.ToCamera({0, 0, 0});
        EXPECT_NEAR(origin[2], 1.7, 1e-6);
        EXPECT_EQ(camera.image, folder / (camera.name + ".png"));
      }
    }
    EXPECT_EQ(ReadCameras(folder / "transforms_lr.json")->cameras[0].name, "lr/001");
  }
}

TEST(TransformsJson, NerfSyntheticTakesSizeFromThePicture) {
  const TestFolder folder;
  std::filesystem::create_directory(folder / "train");
  ASSERT_TRUE(WritePng(folder / "train" / "r_0.png", Image(12, 8, 3)).ok());
  const std::string text = R"({"camera_angle_x": 1.0, "frames": [{"file_path": "./train/r_0", "rotation": 0.01,)" +
                           std::string(kIdentity) + "}]}";
  const auto set = ReadText(folder, text);
  ASSERT_TRUE(set.ok()) << set.error().message;
  const Camera& camera = set->cameras.at(0);
  EXPECT_EQ(camera.name, "train/r_0");
  EXPECT_EQ(camera.image, folder / "train/r_0.png");
  EXPECT_EQ(camera.intrinsics.width, 12);
  EXPECT_EQ(camera.intrinsics.height, 8);
  EXPECT_NEAR(camera.intrinsics.fx, 6 / std::tan(0.5), 1e-12);
  EXPECT_EQ(camera.intrinsics.cy, 4);
  EXPECT_FALSE(set->background.has_value());
  // OpenGL identity: looks along −z, y up.
  EXPECT_EQ(camera.ToCamera({0, 0, -2})[2], 2);
  EXPECT_EQ(camera.ToCamera({0, 1, 0})[1], -1);

  std::filesystem::remove(folder / "train" / "r_0.png");
  const auto missing = ReadText(folder, text);
  ASSERT_FALSE(missing.ok());
  EXPECT_NE(missing.error().message.find("train/r_0"), std::string::npos) << missing.error().message;
}

TEST(TransformsJson, FramesOverrideTheFile) {
  const TestFolder folder;
  const std::string text = std::string(R"({"fl_x": 100, "fl_y": 110, "cx": 30.5, "cy": 20, "w": 64.0, "h": 48,
      "k1": 0.0, "camera_model": "OPENCV", "frames": [{"file_path": "a.png",)") +
                           kIdentity + R"(}, {"file_path": "b.JPG", "fl_x": 50, "w": 32, "cx": 16,)" + kIdentity +
                           R"(}, {"file_path": "c.v2", "camera_angle_x": 1.5707963267948966,)" + kIdentity + "}]}";
  const auto set = ReadText(folder, text);
  ASSERT_TRUE(set.ok()) << set.error().message;
  ASSERT_EQ(set->cameras.size(), 3u);
  const Pinhole &a = set->cameras[0].intrinsics, &b = set->cameras[1].intrinsics, &c = set->cameras[2].intrinsics;
  EXPECT_EQ(a.fx, 100);
  EXPECT_EQ(a.fy, 110);
  EXPECT_EQ(a.cx, 30.5);
  EXPECT_EQ(a.width, 64);
  EXPECT_EQ(b.fx, 50);
  EXPECT_EQ(b.fy, 110);
  EXPECT_EQ(b.width, 32);
  EXPECT_EQ(b.height, 48);
  EXPECT_EQ(b.cx, 16);
  EXPECT_NEAR(c.fx, 32, 1e-12);
  EXPECT_EQ(set->cameras[1].name, "b");
  EXPECT_EQ(set->cameras[2].name, "c.v2");
  EXPECT_TRUE(set->cameras[0].image.empty());
}

TEST(TransformsJson, LensesMasksAndPoints) {
  const TestFolder folder;
  std::filesystem::create_directories(folder / "masks");
  ASSERT_TRUE(WritePng(folder / "m.png", Image(8, 8, 1)).ok());
  const auto lens_of = [&](const std::string& words) {
    const auto set = ReadText(folder, OneFrame(R"("w": 8, "h": 8, "fl_x": 10, )" + words));
    EXPECT_TRUE(set.ok()) << set.error().message;
    return set->cameras[0].photograph.lens;
  };
  Lens lens{.model = LensModel::kRadial, .radial = {0.1, 0.2, 0.3, 0.4}, .tangential = {0.01, 0.02}};
  EXPECT_EQ(lens_of(R"("k1": 0.1, "k2": 0.2, "k3": 0.3, "k4": 0.4, "p1": 0.01, "p2": 0.02)"), lens);
  EXPECT_EQ(lens_of(R"("k1": 9, "distortion_params": [0.1, 0.2, 0.3, 0.4, 0.01, 0.02])"), lens);
  EXPECT_EQ(lens_of(R"("camera_model": "PINHOLE", "k1": 0)"), Lens{});
  const Lens full{.model = LensModel::kRadial, .radial = {0.1, 0, 0, 0}, .denominator = {0.4, 0, 0.5}};
  EXPECT_EQ(lens_of(R"("camera_model": "FULL_OPENCV", "k1": 0.1, "k4": 0.4, "k6": 0.5)"), full);
  lens = {.model = LensModel::kFisheye, .radial = {0.1, 0, 0, 0.4}};
  EXPECT_EQ(lens_of(R"("camera_model": "OPENCV_FISHEYE", "k1": 0.1, "k4": 0.4)"), lens);
  EXPECT_EQ(lens_of(R"("is_fisheye": true, "k1": 0.1, "k4": 0.4)"), lens);
  EXPECT_EQ(lens_of(R"("camera_model": "OPENCV_FISHEYE")"), Lens{.model = LensModel::kFisheye});

  const std::string good = R"("w": 8, "h": 8, "fl_x": 10, "ply_file_path": "sparse_pc.ply")";
  auto set = ReadText(folder, OneFrame(good, R"("mask_path": "./m.png")"));
  ASSERT_TRUE(set.ok()) << set.error().message;
  EXPECT_EQ(set->cameras[0].photograph.mask, folder / "m.png");
  EXPECT_EQ(set->points, folder / "sparse_pc.ply");
  set = ReadText(folder, OneFrame(good));
  EXPECT_TRUE(set->cameras[0].photograph.mask.empty());
}

TEST(TransformsJson, OpenCvAxesWhereTheFileSaysSo) {
  const TestFolder folder;
  const std::string good = R"("w": 8, "h": 8, "fl_x": 10)";
  const auto gl = ReadText(folder, OneFrame(good)),
             cv = ReadText(folder, OneFrame(good + R"(, "camera_axes": "opencv")"));
  ASSERT_TRUE(cv.ok()) << cv.error().message;
  const auto seen = cv->cameras[0].ToCamera({0.5, 1, 2}), other = gl->cameras[0].ToCamera({0.5, 1, 2});
  EXPECT_NEAR(seen[0], other[0], 1e-12);
  EXPECT_NEAR(seen[1], -other[1], 1e-12);
  EXPECT_NEAR(seen[2], -other[2], 1e-12);
  EXPECT_TRUE(ReadText(folder, OneFrame(good + R"(, "camera_axes": "opengl")")).ok());
  EXPECT_FALSE(ReadText(folder, OneFrame(good + R"(, "camera_axes": "OpenCV axes")")).ok());
}

TEST(TransformsJson, MalformedFilesSayWhatIsWrong) {
  const TestFolder folder;
  const std::string good = R"("w": 8, "h": 8, "fl_x": 10)";
  ASSERT_TRUE(ReadText(folder, OneFrame(good)).ok());
  EXPECT_TRUE(ReadText(folder, OneFrame(good, R"("distortion_params": [0, 0.0, 0, 0, 0, 0])")).ok());
  const auto replaced = [&](const std::string& from, const std::string& to) {
    std::string text = OneFrame(good);
    return text.replace(text.find(from), from.size(), to);
  };
  const std::pair<std::string, std::string> cases[] = {
      {"", "line 1"},
      {"{", "line 1"},
      {"{\n\"frames\": [,]}", "line 2"},
      {"[1", "line 1"},
      {"{}", "\"frames\" is missing"},
      {R"({"frames": 3})", "frames: expected an array"},
      {R"({"frames": []})", "at least one frame"},
      {R"({"frames": [7]})", "frames[0]"},
      {R"({"frames": [{}]})", "\"file_path\" is missing"},
      {R"({"frames": [{"file_path": 4}]})", "frames[0].file_path: expected a string"},
      {R"({"frames": [{"file_path": ""}]})", "path of a picture"},
      {R"({"frames": [{"file_path": "a\u0000b"}]})", "path of a picture"},
      {OneFrame(R"("w": 8, "h": 8)"), "no focal length"},
      {OneFrame(R"("fl_x": 10)"), "no image size"},
      {OneFrame(R"("fl_x": 10, "w": 8)"), "no image size"},
      {OneFrame(good, R"("w": 0)"), "frames[0].w: expected a whole number"},
      {OneFrame(good, R"("h": 7.5)"), "frames[0].h: expected a whole number"},
      {OneFrame(good, R"("h": "8")"), "frames[0].h: expected a number, found string"},
      {OneFrame(good, R"("w": 500000, "h": 500000)"), "pixels"},
      {OneFrame(good, R"("fl_x": 0)"), "focal length 0"},
      {OneFrame(good, R"("fl_y": -3)"), "focal length 10, -3"},
      {OneFrame(good, R"("fl_x": 1e999)"), "1e999"},
      {OneFrame(good, R"("fl_x": NaN)"), "line 1"},
      {OneFrame(good, R"("fl_x": null)"), "expected a number, found null"},
      {OneFrame(R"("w": 8, "h": 8, "camera_angle_x": 3.2)"), "camera_angle_x: field of view"},
      {OneFrame(good, R"("k1": "x")"), "frames[0].k1"},
      {OneFrame(good, R"("k1": 1e999)"), "1e999"},
      {OneFrame(good, R"("distortion_params": [0, 0, 0, "x", 0, 0])"), "frames[0].distortion_params[3]"},
      {OneFrame(good, R"("distortion_params": [0, 0, 0, 0, 0, 0, 1])"), "found 7"},
      {OneFrame(good, R"("k1": 1e300)"), "frames[0]"},
      {OneFrame(good, R"("k1": 1e300)"), "lens distortion (k1 = 1e+300)"},
      {OneFrame(good, R"("k1": -50)"), "lens distortion (k1 = -50)"},
      {OneFrame(good, R"("mask_path": "missing.png")"), "mask missing.png not found"},
      {OneFrame(good, R"("mask_path": 3)"), "mask_path: expected a string"},
      {OneFrame(good + R"(, "ply_file_path": 3)"), "ply_file_path: expected a string"},
      {OneFrame(good, R"("distortion_params": 0.1)"), "distortion_params: expected an array"},
      {OneFrame(good + R"(, "camera_model": "EQUIRECTANGULAR")"), "EQUIRECTANGULAR"},
      {OneFrame(good + R"(, "is_fisheye": true, "p1": 0.1)"), "fisheye"},
      {OneFrame(good + R"(, "background": [0, 0])"), "background: expected 3 numbers"},
      {OneFrame(good + R"(, "background": [0, 0, 255])"), "background"},
      {OneFrame(good + R"(, "background": "black")"), "background"},
      {replaced("[1,0,0,0],[0,1,0,0],", ""), "found 2 rows"},
      {replaced("[1,0,0,0]", "[2,0,0,0]"), "not a rotation"},
      {replaced("[1,0,0,0]", "[-1,0,0,0]"), "not a rotation"},
      {replaced("[1,0,0,0]", "[0,0,0,0]"), "not a rotation"},
      {replaced("[1,0,0,0]", "[1,0,0]"), "transform_matrix[0]: expected 4 numbers"},
      {replaced("[1,0,0,0]", "7"), "transform_matrix[0]: expected an array"},
      {replaced("[1,0,0,0]", "[1,0,0,\"x\"]"), "transform_matrix[0][3]"},
      {replaced("[0,0,0,1]", "[0,0,1,1]"), "last row"},
      {replaced("transform_matrix", "matrix"), "\"transform_matrix\" is missing"},
  };
  for (const auto& [text, expected] : cases) {
    const auto set = ReadText(folder, text);
    ASSERT_FALSE(set.ok()) << text;
    EXPECT_EQ(set.error().code, ErrorCode::kBadFile) << text;
    EXPECT_NE(set.error().message.find(expected), std::string::npos) << text << "\n" << set.error().message;
    EXPECT_NE(set.error().message.find("transforms.json: "), std::string::npos) << set.error().message;
  }
}

TEST(TransformsJson, DeepNestingAndHugeFilesAreRefused) {
  const TestFolder folder;
  for (const char* open : {"[", "{\"a\":"}) {
    std::string text;
    for (int i = 0; i < 200000; ++i) text += open;
    const auto set = ReadText(folder, text);
    ASSERT_FALSE(set.ok());
    EXPECT_NE(set.error().message.find("nested deeper"), std::string::npos) << set.error().message;
  }
  std::filesystem::resize_file(folder / "transforms.json", (uint64_t{256} << 20) + 1);  // sparse: takes no space
  const auto set = ReadCameras(folder / "transforms.json");
  ASSERT_FALSE(set.ok());
  EXPECT_NE(set.error().message.find("268,435,457 bytes, more than the limit of 268,435,456 bytes"), std::string::npos)
      << set.error().message;
}

TEST(TransformsJson, EveryTruncationIsAnError) {
  const TestFolder folder;
  const std::string text = OneFrame(R"("w": 8, "h": 8, "fl_x": 10)");
  for (size_t length = 0; length < text.size(); ++length) EXPECT_FALSE(ReadText(folder, text.substr(0, length)).ok());
}

TEST(ReadCameras, MissingFilesAreErrors) {
  const TestFolder folder;
  EXPECT_EQ(ReadCameras(folder / "none.json").error().code, ErrorCode::kNotFound);
}

}  // namespace
}  // namespace anchorsplat
