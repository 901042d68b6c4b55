#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <numeric>

#include "render/bin.h"
#include "render/gpu_scene_for_test.h"
#include "render/project.h"
#include "render/rasterizer_state.h"
#include "render/scenes_for_test.h"

// What lies between a cloud and its picture: depths, their order, and the lists of the tiles.
namespace anchorsplat {
namespace {

using test::DrawOnGpu;
using test::RandomCamera;
using test::RandomCloud;
using test::ReadBack;

struct Seen {
  std::vector<ProjectedGaussian> projected;
  std::vector<TileRect> tiles;
};

// What the GPU has projected, as the CPU would.
Seen ReadSeen(const GpuRasterizer& gpu) {
  const auto n = static_cast<size_t>(gpu.count);
  const auto seen = ReadBack<GpuSeen>(*gpu.device, *gpu.seen, n);
  const auto rects = ReadBack<std::array<uint32_t, 2>>(*gpu.device, *gpu.rects, n);
  Seen out{std::vector<ProjectedGaussian>(n), std::vector<TileRect>(n)};
  for (size_t i = 0; i < n; ++i) {
    const auto half = [&](size_t k, int shift) { return static_cast<uint16_t>(rects[i][k] >> shift); };
    out.tiles[i] = {half(0, 0), half(0, 16), half(1, 0), half(1, 16)};
    const GpuSeen& g = seen[i];
    ProjectedGaussian& p = out.projected[i];
    p.x = double{g.at[0]} + double{g.at_low[0]}, p.y = double{g.at[1]} + double{g.at_low[1]};
    p.u_xx = g.u[0], p.u_xy = g.u[1], p.u_yy = g.u[2];
    p.log2_opacity = g.log2_opacity, p.depth = g.depth;
  }
  return out;
}

std::vector<int32_t> OrderOf(const Seen& seen) {
  std::vector<int32_t> order;
  for (size_t i = 0; i < seen.tiles.size(); ++i) {
    if (seen.tiles[i].x1 != 0) order.push_back(static_cast<int32_t>(i));
  }
  std::stable_sort(order.begin(), order.end(), [&](int32_t a, int32_t b) {
    return seen.projected[static_cast<size_t>(a)].depth < seen.projected[static_cast<size_t>(b)].depth;
  });
  return order;
}

struct Lists {
  std::vector<int64_t> offsets;
  std::vector<int32_t> pairs;
};

Lists ListOnCpu(const Seen& seen, const std::vector<int32_t>& order, const GpuRasterizer& gpu, float min_alpha) {
  const auto tiles = static_cast<size_t>(gpu.tile_count);
  Lists lists;
  lists.offsets.resize(tiles + 1);
  std::vector<TileRect> by_depth(order.size());
  std::vector<uint32_t> counts(tiles);
  BinParams bin{};
  bin.count = static_cast<int64_t>(order.size());
  bin.order = order.data();
  bin.tiles = seen.tiles.data();
  bin.projected = seen.projected.data();
  bin.min_alpha = min_alpha;
  bin.tiles_x = static_cast<int>(gpu.view.size[2]), bin.tiles_y = static_cast<int>(gpu.view.size[3]);
  bin.chunks = 1;
  bin.tiles_by_depth = by_depth.data();
  bin.chunk_counts = counts.data();
  bin.tile_offsets = lists.offsets.data();
  CountPairs(bin);
  lists.pairs.resize(static_cast<size_t>(lists.offsets.back()) + 1);
  ListPairs(bin, 0, gpu.tile_count, lists.pairs.data());
  lists.pairs.pop_back();
  return lists;
}

class GpuListsTest : public testing::Test {
 protected:
  void SetUp() override {
    std::shared_ptr<GpuDevice> device = GpuForTest();
    if (device == nullptr) GTEST_FAIL() << "no device";
    gpu_ = std::make_unique<GpuRasterizer>(std::move(device));
  }
  std::unique_ptr<GpuRasterizer> gpu_;
};

TEST_F(GpuListsTest, DepthsAreThoseOfDoubles) {
  int64_t compared = 0;
  for (uint64_t seed = 100; seed < 110; ++seed) {
    const GaussianCloud cloud = RandomCloud(seed, {.gaussians = 1000, .degree = 0});
    const Camera camera = RandomCamera(seed, 64, 64);
    DrawOnGpu(*gpu_, cloud, camera, {});
    const Seen seen = ReadSeen(*gpu_);
    for (size_t i = 0; i < seen.tiles.size(); ++i) {
      if (seen.tiles[i].x1 == 0) continue;
      const Pose& pose = camera.world_to_camera;
      double z = pose.translation[2];
      for (size_t k = 0; k < 3; ++k) z += pose.rotation[6 + k] * cloud.means[3 * i + k];
      EXPECT_EQ(seen.projected[i].depth, static_cast<float>(z));
      ++compared;
    }
  }
  EXPECT_GT(compared, 5000);
}

TEST_F(GpuListsTest, PlacesAreFinerThanFloats) {
  const GaussianCloud cloud = RandomCloud(5, {.gaussians = 1000, .degree = 0});
  Camera camera = RandomCamera(5, 64, 64);
  camera.intrinsics.cx += 1000, camera.intrinsics.width = 2064;
  std::vector<ProjectedGaussian> projected(1000);
  std::vector<TileRect> tiles(1000);
  std::vector<int32_t> visible(1000), counts(1);
  ProjectParams params = ProjectInputs(cloud, camera, kNear, {});
  params.projected = projected.data(), params.tiles = tiles.data();
  params.visible = visible.data(), params.visible_counts = counts.data();
  ProjectCpu(params);
  DrawOnGpu(*gpu_, cloud, camera, {});
  const Seen seen = ReadSeen(*gpu_);
  int64_t compared = 0;
  for (size_t i = 0; i < 1000; ++i) {
    if (tiles[i].x1 == 0 || seen.tiles[i].x1 == 0) continue;
    EXPECT_NEAR(seen.projected[i].x, projected[i].x, 1e-7);
    EXPECT_NEAR(seen.projected[i].y, projected[i].y, 1e-7);
    ++compared;
  }
  EXPECT_GT(compared, 500);
}

// Of rectangles that nobody cuts, exactly: order, offsets and lists.
TEST_F(GpuListsTest, PairsAreTheCpusOfTheSameProjectedValues) {
  for (const uint64_t seed : {1, 2, 3}) {
    // Depths of a grid, so that many are equal.
    GaussianCloud cloud = RandomCloud(seed, {.gaussians = 1000, .degree = 0});
    for (float& x : cloud.means) x = std::round(4 * x) / 4;
    Camera camera = test::FrontCamera(120, 100, 90);
    camera.world_to_camera.translation[2] = 3;
    DrawOnGpu(*gpu_, cloud, camera, {});
    const Seen seen = ReadSeen(*gpu_);
    const std::vector<int32_t> order = OrderOf(seen);
    ASSERT_GT(order.size(), 300u);
    EXPECT_EQ(ReadBack<int32_t>(*gpu_->device, *gpu_->rows[0], order.size()), order);
    const Lists lists = ListOnCpu(seen, order, *gpu_, kMinAlpha);
    EXPECT_EQ(gpu_->tile_offsets, lists.offsets);
    EXPECT_EQ(ReadBack<int32_t>(*gpu_->device, *gpu_->pairs[gpu_->listed], lists.pairs.size()), lists.pairs);
  }
}

// Runs of tiles list what one run does.
TEST_F(GpuListsTest, RunsListTheSame) {
  const GaussianCloud cloud = RandomCloud(4, {.gaussians = 600, .degree = 0});
  const Camera camera = RandomCamera(4, 110, 75);
  DrawOnGpu(*gpu_, cloud, camera, {});
  const auto all = ReadBack<int32_t>(*gpu_->device, *gpu_->pairs[gpu_->listed], static_cast<size_t>(gpu_->total_pairs));
  for (const std::array<int64_t, 2> run : {std::array<int64_t, 2>{0, 1}, {3, 17}, {17, 35}, {5, 6}, {0, 35}}) {
    gpu_->ListRun(run[0], run[1]);
    const int64_t first = gpu_->tile_offsets[static_cast<size_t>(run[0])];
    const int64_t last = gpu_->tile_offsets[static_cast<size_t>(run[1])];
    const auto some = ReadBack<int32_t>(*gpu_->device, *gpu_->pairs[gpu_->listed], static_cast<size_t>(last - first));
    EXPECT_TRUE(std::equal(some.begin(), some.end(), all.begin() + first)) << run[0] << " to " << run[1];
  }
}

// Large rectangles are cut by the ellipse, here in floats with a hair more: nothing that the CPU lists is left out, and
// hardly anything comes in addition.
TEST_F(GpuListsTest, LargeRectanglesAreCut) {
  int64_t listed = 0, more = 0, whole = 0;
  for (uint64_t seed = 20; seed < 23; ++seed) {
    const GaussianCloud cloud = RandomCloud(seed, {.gaussians = 300, .degree = 0, .smallest = 0.001, .largest = 4});
    const Camera camera = RandomCamera(seed, 300, 220);
    DrawOnGpu(*gpu_, cloud, camera, {});
    const Seen seen = ReadSeen(*gpu_);
    const Lists lists = ListOnCpu(seen, OrderOf(seen), *gpu_, kMinAlpha);
    const auto pairs =
        ReadBack<int32_t>(*gpu_->device, *gpu_->pairs[gpu_->listed], static_cast<size_t>(gpu_->total_pairs));
    for (size_t t = 0; t + 1 < lists.offsets.size(); ++t) {
      auto at = pairs.begin() + gpu_->tile_offsets[t];
      const auto end = pairs.begin() + gpu_->tile_offsets[t + 1];
      for (int64_t k = lists.offsets[t]; k < lists.offsets[t + 1]; ++k) {
        at = std::find(at, end, lists.pairs[static_cast<size_t>(k)]);
        ASSERT_NE(at, end) << "tile " << t;
      }
    }
    listed += lists.offsets.back();
    more += gpu_->total_pairs - lists.offsets.back();
    for (const TileRect& rect : seen.tiles) whole += (rect.x1 - rect.x0) * (rect.y1 - rect.y0);
  }
  EXPECT_LE(more, listed / 1000) << "of " << listed << ", and " << whole << " are not cut";
  EXPECT_LT(listed, whole * 9 / 10);
}

}  // namespace
}  // namespace anchorsplat
