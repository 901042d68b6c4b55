#include "cameras/undistortion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "cameras/camera_io.h"
#include "cameras/photograph.h"
#include "core/random.h"
#include "images/image_io.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

const Lens kBarrel{.model = LensModel::kRadial, .radial = {-0.2, 0.05, 0, 0}, .tangential = {0.001, -0.002}};

// Dots on a dark ground, `step` pixels apart, wide enough to be found to a hundredth of a pixel in 8 bits.
constexpr double kDotWidth = 2.5;
Image Dots(int width, int height, int step) {
  Image image(width, height, 3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double dx = (x + 0.5) - (std::floor((x + 0.5) / step) + 0.5) * step;
      const double dy = (y + 0.5) - (std::floor((y + 0.5) / step) + 0.5) * step;
      const auto value = static_cast<float>(std::exp(-0.5 * (dx * dx + dy * dy) / (kDotWidth * kDotWidth)));
      for (int c = 0; c < 3; ++c) image.at(c, y, x) = value;
    }
  }
  return image;
}

// The centre of what is bright around (u, v); nothing at the border.
std::optional<PlanePoint> CentreNear(const Image& image, double u, double v, int reach) {
  double sum = 0, x = 0, y = 0;
  for (int j = static_cast<int>(v) - reach; j <= static_cast<int>(v) + reach; ++j) {
    for (int i = static_cast<int>(u) - reach; i <= static_cast<int>(u) + reach; ++i) {
      if (i < 0 || j < 0 || i >= image.width || j >= image.height) return std::nullopt;
      const double weight = std::max(0.0f, image.at(0, j, i) - 0.05f);
      sum += weight, x += weight * (i + 0.5), y += weight * (j + 0.5);
    }
  }
  if (sum < 1) return std::nullopt;
  return PlanePoint{x / sum, y / sum};
}

// In one project with a camera per model: the pinhole and every dot are where `colmap image_undistorter` has them.
TEST(Undistortion, AgreesWithColmap) {
  if (std::system("colmap help > /dev/null 2>&1") != 0) {
    GTEST_SKIP() << "colmap is not installed: not compared with its image_undistorter (apt-get install colmap)";
  }
  const std::vector<std::pair<std::string, std::string>> models = {
      {"SIMPLE_RADIAL", "400 320.5 238 -0.08"},
      {"RADIAL", "420 318 243 -0.12 0.03"},
      {"RADIAL", "420 318 243 0.1 0.02"},
      {"OPENCV", "410 415 322 236 -0.15 0.04 0.002 -0.003"},
      {"FULL_OPENCV", "410 415 322 236 0.11 -0.02 0.001 -0.002 0.003 0.2 0.01 0.001"},
      {"OPENCV_FISHEYE", "330 332 321 239 0.01 -0.02 0.005 -0.001"},
      {"SIMPLE_RADIAL_FISHEYE", "350 320 240 0.02"},
      {"RADIAL_FISHEYE", "350 320 240 0.02 -0.01"},
  };
  const TestFolder folder;
  constexpr int kWidth = 640, kHeight = 480, kStep = 32;
  std::filesystem::create_directories(folder / "images");
  std::filesystem::create_directories(folder / "sparse");
  std::string cameras, images;
  for (size_t i = 0; i < models.size(); ++i) {
    const std::string id = std::to_string(i + 1);
    cameras += id + " " + models[i].first + " 640 480 " + models[i].second + "\n";
    images += id + " 1 0 0 0 0 0 0 " + id + " " + id + ".png\n\n";
    ASSERT_TRUE(WritePng(folder / "images" / (id + ".png"), Dots(kWidth, kHeight, kStep)).ok());
  }
  std::ofstream(folder / "sparse/cameras.txt") << cameras;
  std::ofstream(folder / "sparse/images.txt") << images;
  std::ofstream(folder / "sparse/points3D.txt") << "";
  const std::string dense = (folder / "dense").string();
  const std::string command = "QT_QPA_PLATFORM=offscreen colmap image_undistorter --image_path " +
                              (folder / "images").string() + " --input_path " + (folder / "sparse").string() +
                              " --output_path " + dense + " > /dev/null 2>&1";
  ASSERT_EQ(std::system(command.c_str()), 0) << command;
  const auto ours = ReadCameras(folder / "sparse"), theirs = ReadCameras(folder / "dense/sparse");
  ASSERT_TRUE(ours.ok()) << ours.error().message;
  ASSERT_TRUE(theirs.ok()) << theirs.error().message;
  double worst = 0;
  for (const Camera& camera : ours->cameras) {
    const auto found = std::find_if(theirs->cameras.begin(), theirs->cameras.end(),
                                    [&](const Camera& c) { return c.name == camera.name; });
    ASSERT_NE(found, theirs->cameras.end());
    const Pinhole &a = camera.intrinsics, &b = found->intrinsics;
    const std::string& model = models[static_cast<size_t>(std::stoi(camera.name)) - 1].first;
    EXPECT_EQ(a.width, b.width) << model;
    EXPECT_EQ(a.height, b.height) << model;
    EXPECT_NEAR(a.fx, b.fx, 1e-9) << model;
    EXPECT_NEAR(a.fy, b.fy, 1e-9) << model;
    EXPECT_NEAR(a.cx, b.cx, 1e-9) << model;
    EXPECT_NEAR(a.cy, b.cy, 1e-9) << model;
    const auto mine = ReadPhotograph(camera);
    ASSERT_TRUE(mine.ok()) << mine.error().message;
    const auto other = ReadImage(folder / "dense/images" / (camera.name + ".png"));
    ASSERT_TRUE(other.ok()) << other.error().message;
    ASSERT_EQ(mine->image.width, other->width);
    ASSERT_EQ(mine->image.height, other->height);
    const LensInverse inverse(camera.photograph.lens);
    const Pinhole& distorted = camera.photograph.intrinsics;
    int dots = 0;
    double of_model = 0;
    for (int v = kStep / 2; v < kHeight; v += kStep) {
      for (int u = kStep / 2; u < kWidth; u += kStep) {
        const auto p = inverse.Undistort({(u - distorted.cx) / distorted.fx, (v - distorted.cy) / distorted.fy});
        if (!p) continue;
        const double x = a.fx * (*p)[0] + a.cx, y = a.fy * (*p)[1] + a.cy;
        const auto here = CentreNear(mine->image, x, y, 10), there = CentreNear(*other, x, y, 10);
        if (!here || !there) continue;
        ++dots;
        of_model = std::max(of_model, std::hypot((*here)[0] - (*there)[0], (*here)[1] - (*there)[1]));
      }
    }
    EXPECT_GT(dots, 100) << model;
    EXPECT_LE(of_model, 0.05) << model;
    worst = std::max(worst, of_model);
  }
  std::cout << "[ measured ] farthest dot from COLMAP's: " << worst << " px\n";
}

// Pixel by pixel: what is asked for is where the formulas say, and between pixels by the cubic.
TEST(Undistortion, LooksUpWhereTheLensDraws) {
  const Pinhole distorted{60, 40, 50, 52, 31, 19};
  Image ramp(60, 40, 3);  // linear functions are kept by the cubic, away from the border
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 60; ++x) {
      ramp.at(0, y, x) = static_cast<float>(x + 0.5) / 60;
      ramp.at(1, y, x) = static_cast<float>(y + 0.5) / 40;
      ramp.at(2, y, x) = 0.5f;
    }
  }
  const auto undistorted = UndistortedPinhole(kBarrel, distorted);
  ASSERT_TRUE(undistorted.ok());
  const ViewPicture out = Undistort({ramp, {}}, kBarrel, distorted, *undistorted);
  int compared = 0;
  for (int y = 0; y < out.image.height; ++y) {
    for (int x = 0; x < out.image.width; ++x) {
      const PlanePoint d = Distort(
          kBarrel, {(x + 0.5 - undistorted->cx) / undistorted->fx, (y + 0.5 - undistorted->cy) / undistorted->fy});
      const double u = distorted.fx * d[0] + distorted.cx, v = distorted.fy * d[1] + distorted.cy;
      if (u < 2 || v < 2 || u > 58 || v > 38) continue;
      ++compared;
      EXPECT_NEAR(out.image.at(0, y, x), u / 60, 1e-5);
      EXPECT_NEAR(out.image.at(1, y, x), v / 40, 1e-5);
      EXPECT_NEAR(out.image.at(2, y, x), 0.5, 1e-6);
    }
  }
  EXPECT_GT(compared, 1500);
  EXPECT_TRUE(out.ignored.empty()) << "COLMAP's rule leaves no blank pixels of such a lens";
}

TEST(Undistortion, WhatIsNotSeenIsIgnored) {
  // A pincushion in a wider pinhole than the rule would take: the corners show nothing.
  const Lens lens{.model = LensModel::kRadial, .radial = {0.3, 0, 0, 0}};
  const Pinhole distorted{40, 40, 40, 40, 20, 20};
  Image white(40, 40, 4);
  std::fill(white.pixels.begin(), white.pixels.end(), 1.0f);
  ViewPicture out = Undistort({white, {}}, lens, distorted, distorted);
  EXPECT_EQ(out.ignored[0], 1);
  EXPECT_EQ(out.ignored[20 * 40 + 20], 0);
  EXPECT_EQ(out.image.at(3, 0, 0), 0);
  EXPECT_NEAR(out.image.at(3, 20, 20), 1, 1e-6);
  // Next to an ignored pixel, too, and nowhere else.
  Buffer<uint8_t> ignored(1600, 0);
  ignored[20 * 40 + 20] = 1;
  out = Undistort({white, ignored}, Lens{}, distorted, distorted);
  EXPECT_EQ(out.ignored[20 * 40 + 20], 1);
  EXPECT_EQ(out.ignored[25 * 40 + 25], 0);
}

TEST(Undistortion, LensesThatCannotBeAreErrorsOrBounded) {
  const Pinhole distorted{640, 480, 400, 400, 320, 240};
  EXPECT_EQ(UndistortedPinhole({.model = LensModel::kRadial, .radial = {-1e12, 0, 0, 0}}, distorted).error().code,
            ErrorCode::kBadFile);
  Random random(3);
  for (int i = 0; i < 300; ++i) {
    Lens lens{.model = i % 2 == 0 ? LensModel::kRadial : LensModel::kFisheye};
    for (double& k : lens.radial) k = std::tan(random.Uniform(-1.57, 1.57));
    if (i % 2 == 0) {
      for (double& k : lens.denominator) k = std::tan(random.Uniform(-1.57, 1.57));
      for (double& p : lens.tangential) p = random.Uniform(-1, 1);
    }
    const auto undistorted =
        UndistortedPinhole(lens, {64, 48, random.Uniform(1, 200), 50, random.Uniform(-50, 100), 24});
    if (!undistorted.ok()) continue;
    EXPECT_GE(undistorted->width, 12);
    EXPECT_LE(undistorted->width, 128);
    const ViewPicture out = Undistort({Image(64, 48, 3), {}}, lens, {64, 48, 50, 50, 32, 24}, *undistorted);
    EXPECT_EQ(out.image.width, undistorted->width);
    EXPECT_EQ(out.image.height, undistorted->height);
    EXPECT_TRUE(out.ignored.empty() || std::ssize(out.ignored) == out.image.plane());
  }
}

TEST(Undistortion, LensesThatMakeNoSenseAreRefusedWithTheirCoefficients) {
  const Pinhole distorted{400, 300, 400, 400, 200, 150};
  const auto radial = [](double k1, double k2 = 0) {
    return Lens{.model = LensModel::kRadial, .radial = {k1, k2, 0, 0}};
  };
  const std::pair<Lens, const char*> bad[] = {
      {radial(1e300), "k1 = 1e+300"},
      {radial(1e6), "k1 = 1e+06"},
      {radial(-50), "k1 = -50"},
      {radial(-3), "k1 = -3"},
      {radial(0.1, -1e4), "k1 = 0.1, k2 = -10000"},
      {{.model = LensModel::kRadial, .denominator = {-1e3, 0, 0}}, "k4 = -1000"},
      {{.model = LensModel::kRadial, .tangential = {0, 1e4}}, "p2 = 10000"},
      {{.model = LensModel::kFisheye, .radial = {-100, 0, 0, 0}}, "k1 = -100"},
      {{.model = LensModel::kFisheye, .radial = {1e9, 0, 0, 0}}, "k1 = 1e+09"},
  };
  for (const auto& [lens, words] : bad) {
    const auto undistorted = UndistortedPinhole(lens, distorted);
    ASSERT_FALSE(undistorted.ok()) << words << ": " << undistorted->width << " x " << undistorted->height;
    EXPECT_EQ(undistorted.error().code, ErrorCode::kBadFile);
    EXPECT_NE(undistorted.error().message.find(words), std::string::npos) << undistorted.error().message;
  }
}

// Lenses as cameras that people have are calibrated to.
TEST(Undistortion, RealLensesAreNotRefused) {
  const std::tuple<const char*, Lens, Pinhole> real[] = {
      {"phone", {.model = LensModel::kRadial, .radial = {0.05, -0.08, 0, 0}}, {4032, 3024, 3100, 3100, 2016, 1512}},
      {"phone, ultra wide",
       {.model = LensModel::kRadial, .radial = {-0.03, 0.01, 0, 0}},
       {4032, 3024, 1600, 1600, 2016, 1512}},
      {"GoPro, OPENCV",
       {.model = LensModel::kRadial, .radial = {-0.26, 0.08, 0, 0}, .tangential = {0.001, -0.001}},
       {4000, 3000, 1760, 1760, 2000, 1500}},
      {"GoPro, SIMPLE_RADIAL",
       {.model = LensModel::kRadial, .radial = {-0.3, 0, 0, 0}},
       {4000, 3000, 1840, 1840, 2000, 1500}},
      {"GoPro, fisheye",
       {.model = LensModel::kFisheye, .radial = {0.04, 0.02, -0.01, 0.001}},
       {2704, 2028, 1190, 1190, 1352, 1014}},
      {"pincushion", {.model = LensModel::kRadial, .radial = {0.3, 0.1, 0, 0}}, {6000, 4000, 5000, 5000, 3000, 2000}},
      {"whole circle in 16:9", {.model = LensModel::kFisheye}, {3840, 2160, 687, 687, 1920, 1080}},
      {"whole circle in 2:1", {.model = LensModel::kFisheye}, {3840, 1920, 611, 611, 1920, 960}},
      {"cropped", {.model = LensModel::kRadial, .radial = {-0.1, 0.02, 0, 0}}, {500, 400, 900, 900, 700, 450}},
  };
  for (const auto& [name, lens, distorted] : real) {
    const auto undistorted = UndistortedPinhole(lens, distorted);
    EXPECT_TRUE(undistorted.ok()) << name << ": " << undistorted.error().message;
  }
}

TEST(Downscaled, IsTheMeanOfTheArea) {
  Image image(7, 5, 4);
  Random random(5);
  for (float& x : image.pixels) x = static_cast<float>(random.Uniform());
  Buffer<uint8_t> ignored(35, 0);
  ignored[8] = 1;
  const ViewPicture half = Downscaled({image, ignored}, 2);
  ASSERT_EQ(half.image.width, 3);
  ASSERT_EQ(half.image.height, 2);
  for (int y = 0; y < 2; ++y) {
    for (int x = 0; x < 3; ++x) {
      double alpha = 0, red = 0;
      for (int j = 0; j < 2; ++j) {
        for (int i = 0; i < 2; ++i) {
          const double a = static_cast<double>(image.at(3, 2 * y + j, 2 * x + i));
          alpha += a / 4;
          red += a * static_cast<double>(image.at(0, 2 * y + j, 2 * x + i)) / 4;
        }
      }
      EXPECT_NEAR(half.image.at(3, y, x), alpha, 1e-6);
      EXPECT_NEAR(half.image.at(0, y, x), red / alpha, 1e-5);
      EXPECT_EQ(half.ignored[static_cast<size_t>(3 * y + x)], x == 0 && y == 0 ? 1 : 0);
    }
  }
  const Pinhole k = Downscaled(Pinhole{7, 5, 10, 12, 3.5, 2.5}, 2);
  EXPECT_EQ(k, (Pinhole{3, 2, 5, 6, 1.75, 1.25}));
}

}  // namespace
}  // namespace anchorsplat
