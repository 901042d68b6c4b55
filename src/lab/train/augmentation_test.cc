#include "train/augmentation.h"

#include <gtest/gtest.h>

#include <cmath>

#include "render/rasterizer.h"
#include "render/scenes_for_test.h"

namespace anchorsplat {
namespace {

using test::RandomCamera;
using test::RandomCloud;

Image Render(const AugmentedScene& scene, size_t view) {
  Rasterizer rasterizer;
  RenderOutput output;
  const Status status =
      rasterizer.Render(scene.cloud, scene.cameras[view], {.background = scene.truth[view].background}, output);
  EXPECT_TRUE(status.ok());
  return std::move(output.color);
}

// A splat whose truth is its own picture: whatever augmentation does to both, they must stay the same.
AugmentedScene PerfectScene() {
  AugmentedScene scene;
  scene.cloud = RandomCloud(5, {.gaussians = 200});
  scene.pixel_sizes.assign(200, 0.01f);
  for (uint64_t v = 0; v < 2; ++v) {
    scene.cameras.push_back(RandomCamera(v, 50, 40));
    TrueView truth;
    truth.background = {0.1f, 0.2f, 0.3f};
    truth.object = {5, 6, 20, 30};
    scene.truth.push_back(truth);
    scene.truth.back().picture = Render(scene, v);
  }
  return scene;
}

double Difference(const AugmentedScene& scene) {
  double sum = 0;
  for (size_t v = 0; v < scene.cameras.size(); ++v) {
    const Image image = Render(scene, v);
    for (size_t i = 0; i < image.pixels.size(); ++i)
      sum += std::fabs(image.pixels[i] - scene.truth[v].picture.pixels[i]);
  }
  return sum / static_cast<double>(scene.cameras.size() * scene.truth[0].picture.pixels.size());
}

TEST(Augmentation, SplatAndViewsStayTogether) {
  const double kSmall = 2e-5;  // Gaussians at the cut-off of α change sides
  AugmentedScene rotated = PerfectScene();
  RotateWorld({0.3, -1, 2, 0.4}, rotated);
  EXPECT_LT(Difference(rotated), kSmall);
  AugmentedScene mirrored = PerfectScene();
  const Image before = mirrored.truth[0].picture;
  MirrorWorld(mirrored);
  EXPECT_LT(Difference(mirrored), kSmall);
  EXPECT_EQ(mirrored.truth[0].picture.at(1, 7, 3), before.at(1, 7, 46));
  EXPECT_EQ(mirrored.truth[0].object, (PixelBox{30, 6, 45, 30}));
  AugmentedScene scaled = PerfectScene();
  ScaleWorld(1.7, scaled);
  EXPECT_LT(Difference(scaled), kSmall);
  EXPECT_FLOAT_EQ(scaled.pixel_sizes[3], 0.017f);
  AugmentedScene coloured = PerfectScene();
  ChangeColors({2, 0, 1}, {0.5, 1, 0.7}, coloured);
  EXPECT_LT(Difference(coloured), kSmall);
  EXPECT_FLOAT_EQ(coloured.truth[0].background[0], 0.15f);
  EXPECT_GT(Difference(PerfectScene()) + 1, 1 - 1e-12);
}

TEST(Augmentation, AllTogetherFollowTheSeed) {
  const AugmentationConfig all{.rotate = true, .mirror = true, .scale = 0.3, .permute_colors = true, .gain = 0.4};
  for (uint64_t seed = 0; seed < 4; ++seed) {
    AugmentedScene a = PerfectScene(), b = PerfectScene();
    Random first(seed), second(seed);
    Augment(all, first, a);
    Augment(all, second, b);
    EXPECT_LT(Difference(a), 2e-5);
    EXPECT_EQ(a.cloud.means, b.cloud.means);
    EXPECT_EQ(a.truth[1].picture.pixels, b.truth[1].picture.pixels);
  }
}

TEST(Augmentation, NoiseLeavesTheTruthAlone) {
  AugmentedScene scene = PerfectScene();
  const AugmentedScene before = scene;
  Random random(3);
  Augment({.drop = 0.5, .opacity_noise = 0.3, .pixel_size_noise = 0.2}, random, scene);
  EXPECT_LT(scene.cloud.size(), 200);
  EXPECT_GT(scene.cloud.size(), 60);
  EXPECT_EQ(scene.pixel_sizes.size(), static_cast<size_t>(scene.cloud.size()));
  EXPECT_NE(scene.pixel_sizes[0], before.pixel_sizes[0]);
  EXPECT_EQ(scene.pixel_sizes[0], scene.pixel_sizes[1]);
  EXPECT_EQ(scene.truth[0].picture.pixels, before.truth[0].picture.pixels);
  AugmentedScene untouched = PerfectScene();
  Augment({}, random, untouched);
  EXPECT_EQ(untouched.cloud.means, before.cloud.means);
  EXPECT_EQ(untouched.cloud.opacity_logits, before.cloud.opacity_logits);
}

}  // namespace
}  // namespace anchorsplat
