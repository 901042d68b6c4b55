#include "train/seen_gaussians.h"

#include <gtest/gtest.h>

#include <vector>

#include "compact/sheet_cloud_for_test.h"
#include "core/spherical_harmonics.h"
#include "render/rasterizer.h"

namespace anchorsplat {
namespace {

Camera FrontCamera(int size) {
  Camera camera;
  camera.intrinsics = {size, size, 1.0 * size, 1.0 * size, size / 2.0, size / 2.0};
  camera.world_to_camera.translation = {0, 0, 1};
  return camera;
}

// Σ of a Gaussian's weights as how much brighter the picture gets when it does.
TEST(SeenGaussians, WeightsAreWhatAColourAddsToThePicture) {
  GaussianCloud cloud = SheetCloud(60);
  cloud.means[3] += 1000;  // out of sight
  for (size_t i = 20; i < 30; ++i) cloud.opacity_logits[i] = -4;
  std::vector<Camera> cameras(3, FrontCamera(48));
  cameras[2].world_to_camera.translation = {0.3, 0, 1};
  const std::vector<size_t> views = {0, 2};
  const auto seen = SeenGaussians::Look(cloud, cameras, views);
  ASSERT_TRUE(seen.ok()) << seen.error().message;
  EXPECT_EQ(seen->size(), 60);
  int count = 0;
  for (const size_t view : views) {
    for (int64_t i = 0; i < cloud.size(); ++i) {
      GaussianCloud black = WithShDegree(cloud, 0);
      std::fill(black.sh.begin(), black.sh.end(), -0.5f / kSh0);
      black.sh[static_cast<size_t>(3 * i)] = 0.5f / kSh0;
      Rasterizer rasterizer;
      RenderOutput output;
      ASSERT_TRUE(rasterizer.Render(black, cameras[view], {}, output).ok());
      double weight = 0;
      for (int64_t p = 0; p < output.color.plane(); ++p) weight += output.color.pixels[static_cast<size_t>(p)];
      if (std::abs(weight - kSeenPixels) > 1e-3) {
        EXPECT_EQ(seen->In(view, i), weight > kSeenPixels) << "view " << view << ", Gaussian " << i;
      }
      count += seen->In(view, i) ? 1 : 0;
    }
    EXPECT_FALSE(seen->In(view, 1)) << "it lies beside the picture";
  }
  EXPECT_GT(count, 20);
  EXPECT_LT(count, 119);
}

TEST(SeenGaussians, NothingIsSeenOfNothing) {
  const std::vector<Camera> cameras = {FrontCamera(8)};
  const std::vector<size_t> views = {0};
  const auto seen = SeenGaussians::Look(SheetCloud(0), cameras, views);
  ASSERT_TRUE(seen.ok());
  EXPECT_EQ(seen->size(), 0);
}

}  // namespace
}  // namespace anchorsplat
