#include "enhance/refiner.h"

#include <gtest/gtest.h>

#include "fit/orbit_scene_for_test.h"

namespace anchorsplat {
namespace {

TEST(ChooseWindow, IsTheWholeOfSmallViews) {
  const GaussianCloud ball = orbit_scene::Ball(20, 1);
  const auto cameras = orbit_scene::Cameras(2, 300, 200).cameras;
  EXPECT_EQ(ChooseWindow(cameras[0], ball, 1, 5), (PixelBox{0, 0, 300, 200}));
  const auto large = orbit_scene::Cameras(2, 2000, 300).cameras;
  for (int64_t step = 0; step < 20; ++step) {
    const PixelBox box = ChooseWindow(large[0], ball, 1, step);
    EXPECT_EQ(box.x1 - box.x0, kWindow);
    EXPECT_EQ(box.y1 - box.y0, 300);
    EXPECT_GE(box.x0, 0);
    EXPECT_LE(box.x1, 2000);
    EXPECT_EQ(ChooseWindow(large[0], ball, 1, step), box);
  }
  EXPECT_NE(ChooseWindow(large[0], ball, 1, 0), ChooseWindow(large[0], ball, 1, 1));
}

}  // namespace
}  // namespace anchorsplat
