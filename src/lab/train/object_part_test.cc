#include "train/object_part.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "compact/sheet_cloud_for_test.h"
#include "network/torch/render_op.h"
#include "render/rasterizer.h"

namespace anchorsplat {
namespace {

// Around the sheet at a distance of one; the last one looks away from it.
std::vector<Camera> Around(int size) {
  std::vector<Camera> cameras;
  for (const double x : {0.0, 0.5, -0.4, 0.2}) {
    Camera camera;
    camera.intrinsics = {size, size, 1.0 * size, 1.0 * size, size / 2.0, size / 2.0};
    camera.world_to_camera = *LookAt({x, 0.1, -1}, {0, 0, 0}, {0, 1, 0});
    cameras.push_back(camera);
  }
  cameras.back().world_to_camera = *LookAt({0, 0, -1}, {0, 0, -2}, {0, 1, 0});
  return cameras;
}

struct Setting {
  GaussianCloud cloud = SheetCloud(800);
  std::vector<Camera> cameras = Around(120);
  std::vector<size_t> order = {2, 3, 0, 1};
  SeenGaussians seen = *SeenGaussians::Look(cloud, cameras, order);
};

TEST(ObjectPart, HoldsAllThatShowsInItsWindows) {
  const Setting s;
  for (uint64_t seed = 0; seed < 6; ++seed) {
    Random random(seed);
    const ObjectPart part =
        ChoosePart(s.cloud, s.cameras, s.order, s.seen, {.views = 3, .side = 40, .most = 100000}, random);
    ASSERT_EQ(part.views.size(), 3u);
    EXPECT_EQ(part.views[0], 2u) << "the spot is one that the first of the order sees";
    EXPECT_EQ(std::count(part.views.begin(), part.views.end(), size_t{3}), 0) << "it sees nothing";
    EXPECT_TRUE(std::is_sorted(part.wanted.begin(), part.wanted.end()));
    EXPECT_TRUE(std::is_sorted(part.others.begin(), part.others.end()));
    EXPECT_GT(part.wanted.size(), 10u);
    std::vector<int64_t> rows = part.wanted;
    rows.insert(rows.end(), part.others.begin(), part.others.end());
    std::sort(rows.begin(), rows.end());
    EXPECT_EQ(std::set<int64_t>(rows.begin(), rows.end()).size(), rows.size());
    EXPECT_LT(rows.size(), 800u);
    const auto few = Subset(s.cloud, rows);
    ASSERT_TRUE(few.ok());
    for (size_t v = 0; v < part.views.size(); ++v) {
      const PixelBox& window = part.windows[v];
      EXPECT_TRUE(window.x0 >= 0 && window.y0 >= 0 && window.x1 == window.x0 + 40 && window.y1 == window.y0 + 40 &&
                  window.x1 <= 120 && window.y1 <= 120);
      Rasterizer rasterizer;
      RenderOutput all, some;
      const Camera camera = Crop(s.cameras[part.views[v]], window);
      ASSERT_TRUE(rasterizer.Render(s.cloud, camera, {}, all).ok() && rasterizer.Render(*few, camera, {}, some).ok());
      EXPECT_EQ(all.color.pixels, some.color.pixels) << "seed " << seed << ", view " << v;
    }
  }
}

TEST(ObjectPart, TooManyAreThoseNearTheSpot) {
  const Setting s;
  const PartRequest request{.views = 2, .side = 60, .most = 100000}, fewer{.views = 2, .side = 60, .most = 20};
  Random one(5), two(5);
  const ObjectPart all = ChoosePart(s.cloud, s.cameras, s.order, s.seen, request, one);
  const ObjectPart few = ChoosePart(s.cloud, s.cameras, s.order, s.seen, fewer, two);
  EXPECT_EQ(all.windows, few.windows);
  ASSERT_EQ(few.wanted.size(), 20u);
  ASSERT_GT(all.wanted.size(), 20u);
  EXPECT_TRUE(std::includes(all.wanted.begin(), all.wanted.end(), few.wanted.begin(), few.wanted.end()));
  EXPECT_EQ(all.wanted.size() + all.others.size(), few.wanted.size() + few.others.size());
  // A ball: no two of them are farther apart than twice the distance of any that was left out from all of them.
  const auto distance = [&](int64_t a, int64_t b) {
    double sum = 0;
    for (int64_t c = 0; c < 3; ++c) {
      const double d =
          double{s.cloud.means[static_cast<size_t>(3 * a + c)]} - s.cloud.means[static_cast<size_t>(3 * b + c)];
      sum += d * d;
    }
    return sum;
  };
  int centers = 0;
  for (const int64_t spot : few.wanted) {
    double farthest = 0, nearest = 1e9;
    for (const int64_t i : few.wanted) farthest = std::max(farthest, distance(spot, i));
    for (const int64_t i : all.wanted) {
      if (!std::binary_search(few.wanted.begin(), few.wanted.end(), i)) nearest = std::min(nearest, distance(spot, i));
    }
    centers += farthest <= nearest ? 1 : 0;
  }
  EXPECT_GE(centers, 1) << "none of them is the spot";
}

TEST(ObjectPart, WindowsBecomeSmallerWhereGaussiansAreDense) {
  Setting s;
  s.cameras = Around(240);
  s.seen = *SeenGaussians::Look(s.cloud, s.cameras, s.order);
  const PartRequest request{.views = 3, .side = 200, .most = 100000};
  Random one(3);
  const auto seen = static_cast<int64_t>(ChoosePart(s.cloud, s.cameras, s.order, s.seen, request, one).wanted.size());
  const PartRequest half{.views = 3, .side = 200, .most = seen / 2}, whole{.views = 3, .side = 0, .most = seen / 2};
  Random two(3), three(3), four(3);
  const ObjectPart part = ChoosePart(s.cloud, s.cameras, s.order, s.seen, half, two);
  const int side = part.windows[0].x1 - part.windows[0].x0;
  EXPECT_GE(side, 64);
  EXPECT_LT(side, 200);
  EXPECT_LE(static_cast<int64_t>(part.wanted.size()), seen / 2);
  EXPECT_GT(static_cast<int64_t>(part.wanted.size()), seen / 5) << "no smaller than they must be";
  // What it would be with windows of that size from the start: nothing that is seen in them is left out.
  const ObjectPart same =
      ChoosePart(s.cloud, s.cameras, s.order, s.seen, {.views = 3, .side = side, .most = 100000}, three);
  EXPECT_EQ(part.windows, same.windows);
  EXPECT_EQ(part.wanted, same.wanted);
  EXPECT_EQ(part.others, same.others);
  const ObjectPart pictures = ChoosePart(s.cloud, s.cameras, s.order, s.seen, whole, four);
  EXPECT_EQ(pictures.windows[0], (PixelBox{0, 0, 240, 240})) << "who asks for whole pictures gets them";
}

TEST(ObjectPart, WholePicturesAndViewsThatSeeNothing) {
  const Setting s;
  Random random(1);
  const ObjectPart whole =
      ChoosePart(s.cloud, s.cameras, s.order, s.seen, {.views = 9, .side = 0, .most = 9999}, random);
  EXPECT_EQ(whole.views.size(), 4u);
  EXPECT_EQ(whole.views.back(), 3u);
  for (const PixelBox& window : whole.windows) EXPECT_EQ(window, (PixelBox{0, 0, 120, 120}));
  const std::vector<size_t> away = {3};
  const ObjectPart nothing = ChoosePart(s.cloud, s.cameras, away, s.seen, {.views = 1, .side = 30, .most = 50}, random);
  EXPECT_EQ(nothing.wanted.size(), 1u) << "a step has something to work on";
  EXPECT_EQ(nothing.windows[0], (PixelBox{45, 45, 75, 75}));
}

}  // namespace
}  // namespace anchorsplat
