#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include "core/camera.h"
#include "images/image_io.h"

namespace anchorsplat {

// For tests: views around a point with a common lens, for camera files of several programs.

inline void WriteText(const std::filesystem::path& path, const std::string& text) {
  std::filesystem::remove(path);
  std::filesystem::create_directories(path.parent_path());
  std::ofstream(path, std::ios::binary) << text;
}

// All digits, each number followed by a space.
template <typename Numbers>
std::string Digits(const Numbers& numbers) {
  std::ostringstream out;
  out.precision(std::numeric_limits<double>::max_digits10);
  for (const double x : numbers) out << x << ' ';
  return out.str();
}

inline constexpr int kRigWidth = 64, kRigHeight = 48;

// Cameras "a", "b", … of 64 × 48 pixels, 3 units from `target`, with a Brown lens and an off-centre principal point.
inline std::vector<Camera> RigForTest(int count, const std::array<double, 3>& target = {0, 0, 0}) {
  std::vector<Camera> rig;
  for (int i = 0; i < count; ++i) {
    const double angle = 0.4 + i;
    Camera camera;
    camera.name = std::string(1, static_cast<char>('a' + i));
    camera.world_to_camera =
        *LookAt({target[0] + 3 * std::cos(angle), target[1] - 0.5 + 0.3 * i, target[2] + 3 * std::sin(angle)}, target,
                {0, -1, 0.2});
    camera.photograph.intrinsics = {kRigWidth, kRigHeight, 70, 70, 33.5, 22.25};
    camera.photograph.lens = {
        .model = LensModel::kRadial, .radial = {-0.1, 0.02, 0.003, 0}, .tangential = {0.001, -0.002}};
    rig.push_back(camera);
  }
  return rig;
}

// Camera to world, OpenCV axes, row-major.
inline std::array<double, 16> CameraToWorld(const Camera& camera) {
  const auto& r = camera.world_to_camera.rotation;
  const auto c = camera.Center();
  return {r[0], r[3], r[6], c[0], r[1], r[4], r[7], c[1], r[2], r[5], r[8], c[2], 0, 0, 0, 1};
}

inline void WritePicturesOf(const std::vector<Camera>& rig, const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  for (const Camera& camera : rig) {
    ASSERT_TRUE(WritePng(folder / (camera.name + ".png"), Image(kRigWidth, kRigHeight, 3)).ok());
  }
}

// Pixel of a world point in the distorted image.
inline PlanePoint PixelOf(const Camera& camera, const std::array<double, 3>& point) {
  const auto p = camera.ToCamera(point);
  const PlanePoint place = Distort(camera.photograph.lens, {p[0] / p[2], p[1] / p[2]});
  const Pinhole& k = camera.photograph.intrinsics.width > 0 ? camera.photograph.intrinsics : camera.intrinsics;
  return {k.fx * place[0] + k.cx, k.fy * place[1] + k.cy};
}

// Checks that both sets project points around `target` to the same pixels.
inline void ExpectSamePixels(const std::vector<Camera>& found, const std::vector<Camera>& rig,
                             const std::array<double, 3>& target = {0, 0, 0}, double tolerance = 1e-9) {
  ASSERT_EQ(found.size(), rig.size());
  for (size_t i = 0; i < rig.size(); ++i) {
    EXPECT_EQ(found[i].name, rig[i].name);
    for (const auto& d : {std::array<double, 3>{0, 0, 0}, {0.4, 0.1, -0.2}, {-0.3, 0.5, 0.3}, {0.1, -0.4, 0.6}}) {
      const std::array<double, 3> point = {target[0] + d[0], target[1] + d[1], target[2] + d[2]};
      const PlanePoint a = PixelOf(found[i], point), b = PixelOf(rig[i], point);
      EXPECT_NEAR(a[0], b[0], tolerance) << rig[i].name;
      EXPECT_NEAR(a[1], b[1], tolerance) << rig[i].name;
    }
  }
}

}  // namespace anchorsplat
