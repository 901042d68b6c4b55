#include "render/bin.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

#include "core/random.h"
#include "render/constants.h"

namespace anchorsplat {
namespace {

constexpr int kTilesX = 13, kTilesY = 9;

struct Scene {
  std::vector<ProjectedGaussian> gaussians;
  std::vector<TileRect> tiles;
  std::vector<int32_t> order;
};

// Ellipses of all sizes with the tiles of their bounding box, in a shuffled order.
Scene RandomScene(uint64_t seed, size_t count) {
  Random random(seed);
  Scene scene;
  for (size_t i = 0; i < count; ++i) {
    ProjectedGaussian g{};
    g.x = random.Uniform(-100, 300);
    g.y = random.Uniform(-80, 220);
    const double sigma = std::exp(random.Uniform(0, 5));
    const double lean = random.Uniform(-3, 3);
    g.u_xx = static_cast<float>(1 / sigma);
    g.u_xy = static_cast<float>(lean / sigma);
    g.u_yy = static_cast<float>(random.Uniform(0.01, 1));
    g.log2_opacity = static_cast<float>(random.Uniform(-9, 0));
    const int longest = i % 2 == 0 ? 2 : kTilesX;  // half of them on up to 2 × 2 tiles, as most are in a picture
    const auto side = [&](int limit, uint16_t& low, uint16_t& high) {
      low = static_cast<uint16_t>(random.Below(limit));
      high = static_cast<uint16_t>(low + 1 + random.Below(std::min(longest, limit - low)));
    };
    TileRect rect{};
    if (i % 11 != 10) {
      side(kTilesX, rect.x0, rect.x1);
      side(kTilesY, rect.y0, rect.y1);
    }
    scene.gaussians.push_back(g);
    scene.tiles.push_back(rect);
    scene.order.push_back(static_cast<int32_t>(i));
  }
  for (size_t i = count; i > 1; --i) {
    std::swap(scene.order[i - 1], scene.order[static_cast<size_t>(random.Below(static_cast<int64_t>(i)))]);
  }
  return scene;
}

// Whether some pixel centre of the tile sees the Gaussian.
bool Seen(const ProjectedGaussian& g, int tile_x, int tile_y) {
  for (int y = 16 * tile_y; y < 16 * tile_y + 16; ++y) {
    for (int x = 16 * tile_x; x < 16 * tile_x + 16; ++x) {
      const double dx = x + 0.5 - g.x, dy = y + 0.5 - g.y;
      const double u = g.u_xx * dx + g.u_xy * dy, v = g.u_yy * dy;
      if (std::exp2(g.log2_opacity - u * u - v * v) >= kMinAlpha) return true;
    }
  }
  return false;
}

struct Lists {
  std::vector<int64_t> offsets;
  std::vector<int32_t> pairs;
};

Lists List(const Scene& scene, int64_t chunks, int64_t max_pairs) {
  const size_t tiles = kTilesX * kTilesY;
  std::vector<TileRect> by_depth(scene.order.size());
  std::vector<uint32_t> counts(static_cast<size_t>(chunks) * tiles);
  Lists lists;
  lists.offsets.resize(tiles + 1);
  BinParams p{};
  p.count = static_cast<int64_t>(scene.order.size());
  p.order = scene.order.data();
  p.tiles = scene.tiles.data();
  p.projected = scene.gaussians.data();
  p.min_alpha = kMinAlpha;
  p.tiles_x = kTilesX;
  p.tiles_y = kTilesY;
  p.chunks = chunks;
  p.tiles_by_depth = by_depth.data();
  p.chunk_counts = counts.data();
  p.tile_offsets = lists.offsets.data();
  CountPairs(p);
  lists.pairs.assign(static_cast<size_t>(lists.offsets.back() + chunks), -1);
  int runs = 0;
  for (int64_t first = 0, last = 0; first < static_cast<int64_t>(tiles); first = last, ++runs) {
    last = EndOfRun(p, first, max_pairs);
    const int64_t length = lists.offsets[static_cast<size_t>(last)] - lists.offsets[static_cast<size_t>(first)];
    EXPECT_TRUE(length <= max_pairs || last == first + 1);
    ListPairs(p, first, last, lists.pairs.data() + lists.offsets[static_cast<size_t>(first)]);
  }
  EXPECT_EQ(runs > 1, max_pairs < lists.offsets.back());
  lists.pairs.resize(static_cast<size_t>(lists.offsets.back()));  // without the scratch
  return lists;
}

TEST(Bin, ListsByDepthWhatATileMaySee) {
  const Scene scene = RandomScene(1, 300);
  const Lists lists = List(scene, 1, kMaxPairs);
  int64_t extra = 0;
  for (int tile = 0; tile < kTilesX * kTilesY; ++tile) {
    const int x = tile % kTilesX, y = tile / kTilesX;
    int64_t at = lists.offsets[static_cast<size_t>(tile)];
    const int64_t end = lists.offsets[static_cast<size_t>(tile) + 1];
    for (const int32_t i : scene.order) {
      const TileRect rect = scene.tiles[static_cast<size_t>(i)];
      const bool inside = x >= rect.x0 && x < rect.x1 && y >= rect.y0 && y < rect.y1;
      const bool listed = at < end && lists.pairs[static_cast<size_t>(at)] == i;
      at += listed;
      if (!inside) {
        EXPECT_FALSE(listed) << i;
      } else if (Seen(scene.gaussians[static_cast<size_t>(i)], x, y)) {
        EXPECT_TRUE(listed) << i;
      } else {
        extra += listed;
      }
    }
    EXPECT_EQ(at, end) << "tile " << tile << " is not in order of depth";
  }
  // Rectangles of more than 64 tiles are cut to the ellipse; here the rectangles have nothing to do with it.
  int64_t whole = 0;
  for (const TileRect& r : scene.tiles) whole += (r.x1 - r.x0) * (r.y1 - r.y0);
  EXPECT_LT(lists.offsets.back(), whole);
  EXPECT_GT(extra, 0);
}

TEST(Bin, ChunksAndRunsDoNotMatter) {
  const Scene scene = RandomScene(2, 1000);
  const Lists expected = List(scene, 1, kMaxPairs);
  for (const int64_t chunks : {2, 5, 64}) {
    for (const int64_t max_pairs : {int64_t{1}, int64_t{700}, kMaxPairs}) {
      const Lists lists = List(scene, chunks, max_pairs);
      EXPECT_EQ(lists.offsets, expected.offsets);
      EXPECT_EQ(lists.pairs, expected.pairs);
    }
  }
}

TEST(Bin, NothingToList) {
  const Lists lists = List(Scene{}, 1, 10);
  EXPECT_EQ(lists.offsets, std::vector<int64_t>(kTilesX * kTilesY + 1, 0));
}

}  // namespace
}  // namespace anchorsplat
