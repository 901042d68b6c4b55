#include "edit/moved_rows.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "core/camera.h"
#include "core/random.h"
#include "core/rotation.h"
#include "edit/action.h"
#include "formats/random_cloud_for_test.h"
#include "metrics/image_metrics.h"
#include "render/rasterizer.h"

namespace anchorsplat {
namespace {

GaussianCloud SmallSplat(int degree) {
  GaussianCloud cloud = RandomCloud(400, degree, 7);
  for (float& x : cloud.log_scales) x = 0.6f * x - 2.5f;
  for (float& x : cloud.sh) x *= 0.3f;
  return cloud;
}

Similarity MapOf(const char* name, const char* text) {
  const auto action = ParseAction(name, text);
  EXPECT_TRUE(action.ok());
  return std::get<MoveWorld>(action->what).map;
}

void Move(const Similarity& map, GaussianCloud& cloud) {
  RowMover(map, cloud.origin, cloud.origin, cloud.sh_degree).Move(cloud, 0, cloud.size());
}

// Sees of the moved world what `camera` saw before, as a camera cannot mirror: from left to right where the map does.
Camera Moved(const Camera& camera, const Similarity& map, bool mirrors) {
  Camera moved = camera;
  const Similarity from = {camera.world_to_camera.rotation, camera.world_to_camera.translation, 1};
  Similarity to = Compose(from, Inverse(map));
  for (double& x : to.translation) x *= map.scale;  // the picture does not know how large the world is
  if (mirrors) {
    for (size_t k = 0; k < 3; ++k) to.rotation[k] = -to.rotation[k];
    to.translation[0] = -to.translation[0];
  }
  moved.world_to_camera = {to.rotation, to.translation};
  return moved;
}

Image Picture(const GaussianCloud& cloud, const Camera& camera) {
  Rasterizer rasterizer;
  RenderOutput out;
  // Without cut-offs, which one rounding may cross.
  EXPECT_TRUE(rasterizer.Render(cloud, camera, {.min_alpha = 1e-7f, .min_transmittance = 0}, out).ok());
  return out.color;
}

TEST(MovedRows, LookTheSameFromMovedCameras) {
  const Pinhole intrinsics = {.width = 96, .height = 80, .fx = 90, .fy = 90, .cx = 48, .cy = 40};
  for (const int degree : {0, 1, 2, 3}) {
    const GaussianCloud cloud = SmallSplat(degree);
    const auto orbit = OrbitCameras(5, 6, {0.1, -0.2, 0.3}, intrinsics);
    ASSERT_TRUE(orbit.ok());
    for (const auto& [name, text] :
         {std::pair("--rotate", "25,-40,130"), std::pair("--rotate", "0,90,0"), std::pair("--rotate", "180,0,0"),
          std::pair("--translate", "1.5,-2,0.25"), std::pair("--scale", "2.5"), std::pair("--mirror", "x"),
          std::pair("--mirror", "z")}) {
      SCOPED_TRACE(std::to_string(degree) + " " + name + " " + text);
      const Similarity map = MapOf(name, text);
      const bool mirrors = std::string(name) == "--mirror";
      GaussianCloud moved = cloud;
      Move(map, moved);
      for (const Camera& camera : orbit->cameras) {
        const Image before = Picture(cloud, camera);
        Image after = Picture(moved, Moved(camera, map, mirrors));
        if (mirrors) {
          const Image seen = after;
          for (int c = 0; c < 3; ++c) {
            for (int y = 0; y < seen.height; ++y) {
              for (int x = 0; x < seen.width; ++x) {
                after.channel(c)[y * seen.width + x] = seen.channel(c)[y * seen.width + seen.width - 1 - x];
              }
            }
          }
        }
        EXPECT_GE(*Psnr(before, after), 100);
      }
    }
  }
}

TEST(MovedRows, AreRoundedOnce) {
  // A chain of turns is one turn: 36 times 10° is none.
  const GaussianCloud cloud = SmallSplat(3);
  Similarity map;
  for (int i = 0; i < 36; ++i) map = Compose(MapOf("--rotate", "0,0,10"), map);
  GaussianCloud moved = cloud;
  Move(map, moved);
  for (size_t i = 0; i < cloud.sh.size(); ++i)
    EXPECT_NEAR(moved.sh[i], cloud.sh[i], 1e-6f * (1 + std::abs(cloud.sh[i])));
  for (size_t i = 0; i < cloud.means.size(); ++i) EXPECT_NEAR(moved.means[i], cloud.means[i], 1e-6f);
}

TEST(MovedRows, MirroringTwiceChangesNoBit) {
  const GaussianCloud cloud = SmallSplat(3);
  for (const char* axis : {"x", "y", "z"}) {
    GaussianCloud moved = cloud;
    Move(MapOf("--mirror", axis), moved);
    EXPECT_FALSE(SameBits(moved.sh, cloud.sh));
    Move(MapOf("--mirror", axis), moved);
    EXPECT_TRUE(SameBits(moved.means, cloud.means));
    EXPECT_TRUE(SameBits(moved.sh, cloud.sh));
    for (int64_t i = 0; i < cloud.size(); ++i) {  // a quaternion may be the other one of its two
      const float* a = moved.quats.data() + 4 * i;
      const float* b = cloud.quats.data() + 4 * i;
      const float sign = a[0] * b[0] < 0 ? -1.0f : 1.0f;
      for (int k = 0; k < 4; ++k) EXPECT_EQ(a[k], sign * b[k]);
    }
  }
}

TEST(MovedRows, WhatIsNoNumberStaysSo) {
  GaussianCloud cloud = CloudWithNonFinite(300, 3);
  const GaussianCloud before = cloud;
  Move(MapOf("--rotate", "10,20,30"), cloud);
  for (int64_t i = 0; i < cloud.size(); ++i) {
    bool was = true, is = true;
    for (int64_t k = 4 * i; k < 4 * i + 4; ++k) {
      was &= std::isfinite(before.quats[static_cast<size_t>(k)]);
      is &= std::isfinite(cloud.quats[static_cast<size_t>(k)]);
    }
    EXPECT_EQ(was, is);
  }
  EXPECT_TRUE(SameBits(cloud.opacity_logits, before.opacity_logits));
  EXPECT_TRUE(SameBits(cloud.log_scales, before.log_scales));
}

TEST(MovedRows, NoRotationTurnsToo) {
  GaussianCloud cloud = SmallSplat(0);
  std::fill(cloud.quats.begin(), cloud.quats.end(), 0.0f);
  Move(MapOf("--rotate", "0,0,90"), cloud);
  const auto r = RotationFromQuaternion<double>(cloud.quats[0], cloud.quats[1], cloud.quats[2], cloud.quats[3]);
  EXPECT_NEAR(r[3], 1, 1e-6);
}

}  // namespace
}  // namespace anchorsplat
