#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <utility>
#include <vector>

#include "cameras/undistortion.h"
#include "core/camera.h"
#include "scene/meshes_for_test.h"
#include "scene/ray_tracer.h"

namespace anchorsplat {
namespace {

// Of rgb over black, where nothing is ignored.
double PsnrOf(const Image& a, const Image& b, const Buffer<uint8_t>& ignored) {
  double sum = 0;
  int64_t count = 0;
  for (int64_t i = 0; i < a.plane(); ++i) {
    if (!ignored.empty() && ignored[static_cast<size_t>(i)] != 0) continue;
    for (int c = 0; c < 3; ++c) {
      const double off = static_cast<double>(a.channel(c)[i] * a.channel(3)[i] - b.channel(c)[i] * b.channel(3)[i]);
      sum += off * off;
      ++count;
    }
  }
  return -10 * std::log10(sum / static_cast<double>(count));
}

// Many rays of a pinhole that sees more than the lens, 6 × 6 for each of its pixels' share.
constexpr int kDense = 6;
struct WideView {
  Pinhole pinhole;
  Image rays;
};
WideView LookWide(const RayTracer& tracer, Camera camera) {
  constexpr double kMargin = 1.5;
  Pinhole& k = camera.intrinsics;
  k.width = static_cast<int>(kMargin * kDense * k.width);
  k.height = static_cast<int>(kMargin * kDense * k.height);
  k = {k.width, k.height, k.fx * kDense, k.fy * kDense, 0.5 * k.width, 0.5 * k.height};
  return {k, *tracer.Render(camera, {.samples = 1})};
}

// What the lens's camera sees: each of 3 × 3 rays per pixel goes where the lens sends it, and meets what the nearest of
// the many rays meets.
Image ThroughLens(const WideView& wide, const Pinhole& distorted, const Lens& lens) {
  constexpr int kRays = 3;
  const LensInverse inverse(lens);
  Image out(distorted.width, distorted.height, 4);
  for (int y = 0; y < distorted.height; ++y) {
    for (int x = 0; x < distorted.width; ++x) {
      double sum[4] = {0, 0, 0, 0};
      for (int ray = 0; ray < kRays * kRays; ++ray) {
        const double u = x + (ray % kRays + 0.5) / kRays, v = y + (ray / kRays + 0.5) / kRays;
        const auto p = inverse.Undistort({(u - distorted.cx) / distorted.fx, (v - distorted.cy) / distorted.fy});
        if (!p) continue;
        const int column = static_cast<int>(std::floor(wide.pinhole.fx * (*p)[0] + wide.pinhole.cx));
        const int row = static_cast<int>(std::floor(wide.pinhole.fy * (*p)[1] + wide.pinhole.cy));
        if (column < 0 || row < 0 || column >= wide.rays.width || row >= wide.rays.height) continue;
        const double alpha = static_cast<double>(wide.rays.at(3, row, column));
        for (int c = 0; c < 3; ++c) sum[c] += alpha * static_cast<double>(wide.rays.at(c, row, column));
        sum[3] += alpha;
      }
      for (int c = 0; c < 3; ++c) out.at(c, y, x) = sum[3] > 0 ? static_cast<float>(sum[c] / sum[3]) : 0.0f;
      out.at(3, y, x) = static_cast<float>(sum[3] / (kRays * kRays));
    }
  }
  return out;
}

// A picture that was traced through the lens, undone, against one that was traced through the pinhole.
TEST(LensPicture, UndoneIsWhatThePinholeSees) {
  const std::vector<std::pair<const char*, Lens>> lenses = {
      {"barrel", {.model = LensModel::kRadial, .radial = {-0.15, 0.03, 0, 0}, .tangential = {0.001, -0.002}}},
      {"pincushion", {.model = LensModel::kRadial, .radial = {0.1, 0.02, 0, 0}}},
      {"fisheye", {.model = LensModel::kFisheye, .radial = {0.02, -0.01, 0, 0}}},
  };
  Camera camera;
  camera.intrinsics = {400, 300, 380, 380, 203, 148};
  camera.world_to_camera = *LookAt({0.3, -0.4, -1.5}, {0, 0, 0}, {0, -1, 0});
  std::vector<std::pair<const char*, Mesh>> meshes;
  meshes.emplace_back("sphere", SphereMesh(0.5f, 24, true));
  meshes.emplace_back("triangles", RandomTriangles(12, 7));
  for (auto& [mesh_name, mesh] : meshes) {
    const auto tracer = RayTracer::Create(std::move(mesh));
    ASSERT_TRUE(tracer.ok()) << tracer.error().message;
    const WideView wide = LookWide(*tracer, camera);
    for (const auto& [name, lens] : lenses) {
      const auto undistorted = UndistortedPinhole(lens, camera.intrinsics);
      ASSERT_TRUE(undistorted.ok());
      const ViewPicture undone =
          Undistort({ThroughLens(wide, camera.intrinsics, lens), {}}, lens, camera.intrinsics, *undistorted);
      Camera pinhole = camera;
      pinhole.intrinsics = *undistorted;
      const auto truth = tracer->Render(pinhole, {.samples = 4});
      ASSERT_TRUE(truth.ok());
      const double psnr = PsnrOf(undone.image, *truth, undone.ignored);
      std::cout << "[ measured ] " << mesh_name << " through " << name << ": " << psnr << " dB\n";
      EXPECT_GE(psnr, 40) << mesh_name << " through " << name;
    }
  }
}

}  // namespace
}  // namespace anchorsplat
