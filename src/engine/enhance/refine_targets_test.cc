#include "enhance/refine_targets.h"

#include <gtest/gtest.h>

#include "fit/orbit_scene_for_test.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

TEST(FaintPixels, AreHazeFarFromAnythingSolid) {
  Image alpha(20, 12, 1);
  std::fill(alpha.pixels.begin(), alpha.pixels.end(), 0.0f);
  EXPECT_TRUE(FaintPixels(alpha).empty());
  alpha.at(0, 5, 4) = 1;      // an object …
  alpha.at(0, 5, 6) = 0.1f;   // … its outline …
  alpha.at(0, 9, 15) = 0.1f;  // … and haze
  const Buffer<uint8_t> faint = FaintPixels(alpha);
  ASSERT_EQ(faint.size(), 240u);
  for (size_t i = 0; i < faint.size(); ++i) EXPECT_EQ(faint[i], i == 9 * 20 + 15 ? 1 : 0) << i;
}

TEST(RefineTargets, WindowsArePartsOfTheView) {
  const auto ball = std::make_shared<const GaussianCloud>(orbit_scene::Ball(60, 2));
  const auto views = orbit_scene::Cameras(3, 40, 30).cameras;
  RefineTargets targets(ball, {}, views);
  RefineTarget whole, part, again;
  ASSERT_TRUE(targets.Load(1, {0, 0, 40, 30}, whole).ok());
  ASSERT_TRUE(targets.Load(1, {8, 3, 35, 22}, part).ok());
  ASSERT_EQ(part.picture.width, 27);
  ASSERT_EQ(part.picture.height, 19);
  for (int y = 0; y < 19; ++y) {
    for (int x = 0; x < 27; ++x) EXPECT_NEAR(part.picture.at(1, y, x), whole.picture.at(1, y + 3, x + 8), 2e-3);
  }
  ASSERT_TRUE(targets.Load(1, {0, 0, 40, 30}, again).ok());
  EXPECT_EQ(again.picture.pixels, whole.picture.pixels);
  ASSERT_TRUE(targets.Load(2, {0, 0, 40, 30}, again).ok());
  EXPECT_NE(again.picture.pixels, whole.picture.pixels);
}

TEST(RefineTargets, PicturesAreCutOut) {
  TestFolder folder;
  CameraSet set = orbit_scene::Write(folder.path(), orbit_scene::Ball(60, 2), 3, 30);
  for (Camera& camera : set.cameras) camera.image = folder.path() / (camera.name + ".png");
  RefineTargets targets{PictureCache(set.cameras, {0, 0, 0})};
  RefineTarget whole, part;
  ASSERT_TRUE(targets.Load(1, {0, 0, 30, 30}, whole).ok());
  ASSERT_TRUE(targets.Load(1, {5, 6, 25, 19}, part).ok());
  EXPECT_TRUE(part.ignored.empty());
  for (int y = 0; y < 13; ++y) {
    for (int x = 0; x < 20; ++x) EXPECT_EQ(part.picture.at(2, y, x), whole.picture.at(2, y + 6, x + 5));
  }
}

}  // namespace
}  // namespace anchorsplat
