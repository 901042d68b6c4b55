#include "enhance/refine_copies.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fit/orbit_scene_for_test.h"

namespace anchorsplat {
namespace {

TEST(ChooseCopies, AreNoMoreThanACloserViewCanShow) {
  // As most fits are: 20,000 Gaussians, a fifth of 256² pixels.
  const ViewDensity usual{13'000, 20'000};
  EXPECT_EQ(ChooseCopies(usual, 4, 8, 20'000, 20'000), 8);
  // 156,000 of 200² pixels, which would become 1.2 million.
  const ViewDensity dense{10'000, 156'000};
  EXPECT_EQ(ChooseCopies(dense, 4, 8, 156'000, 156'000), 2);
  EXPECT_EQ(ChooseCopies(dense, 2, 8, 156'000, 156'000), 1);
  EXPECT_EQ(ChooseCopies(dense, 8, 8, 156'000, 156'000), 8);
  EXPECT_EQ(ChooseCopies({0, 0}, 4, 8, 10, 10), 1);
}

TEST(ChooseCopies, CountWhatANetworkMadeAlready) {
  const ViewDensity usual{13'000, 20'000};
  EXPECT_EQ(ChooseCopies(usual, 4, 8, 20'000, 80'000), 2);
  EXPECT_EQ(ChooseCopies(usual, 4, 8, 20'000, 400'000), 1);
  EXPECT_EQ(ChooseCopies({13'000, 60'000}, 4, 8, 20'000, 80'000), 1);
}

TEST(MeasureDensity, CountsPixelsAndGaussiansOfTheView) {
  GaussianCloud ball = orbit_scene::Ball(400, 1);
  for (float& x : ball.opacity_logits) x = 4;
  const auto whole = MeasureDensity(ball, {}, orbit_scene::Cameras(20, 60, 60).cameras);
  ASSERT_TRUE(whole.ok());
  EXPECT_EQ(whole->gaussians, 400);
  EXPECT_GT(whole->pixels, 0.1 * 3600);
  EXPECT_LT(whole->pixels, 0.9 * 3600);
  // Nearer, where a part is seen.
  std::vector<Camera> near = orbit_scene::Cameras(20, 60, 60).cameras;
  for (Camera& camera : near) camera.intrinsics.fx = camera.intrinsics.fy *= 5;
  const auto part = MeasureDensity(ball, {}, near);
  ASSERT_TRUE(part.ok());
  EXPECT_LT(part->gaussians, 200);
  EXPECT_GT(part->pixels, 0.9 * 3600);
}

}  // namespace
}  // namespace anchorsplat
