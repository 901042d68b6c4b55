#include "render/gradient_slots.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "core/random.h"
#include "render/project.h"

namespace anchorsplat {
namespace {

constexpr int kSlotTilesX = 13, kSlotTilesY = 9;
constexpr int64_t kSlotTiles = int64_t{kSlotTilesX} * kSlotTilesY;

bool CoversTile(const TileRect& rect, int64_t tile) {
  const int64_t x = tile % kSlotTilesX, y = tile / kSlotTilesX;
  return x >= rect.x0 && x < rect.x1 && y >= rect.y0 && y < rect.y1;
}

// Gaussians on all kinds of rectangles of tiles, in three chunks of which the last one is not full.
struct SlotScene {
  std::vector<TileRect> tiles;
  std::vector<ProjectedGaussian> projected;
  std::vector<int32_t> visible, visible_counts;

  explicit SlotScene(uint64_t seed) : visible(2 * kProjectChunk + 100), visible_counts(3) {
    Random random(seed);
    for (size_t i = 0; i < visible.size(); ++i) {
      TileRect rect{};
      const auto side = [&](int64_t limit, uint16_t& low, uint16_t& high) {
        const int64_t longest = i % 5 == 0 ? limit : 2;
        low = static_cast<uint16_t>(random.Below(limit));
        high = static_cast<uint16_t>(low + 1 + random.Below(std::min(longest, limit - low)));
      };
      side(kSlotTilesX, rect.x0, rect.x1);
      side(kSlotTilesY, rect.y0, rect.y1);
      const bool culled = i % 7 == 3;
      ProjectedGaussian g{};
      g.slot = 12345;
      g.tile_x0 = rect.x0;
      g.tile_y0 = rect.y0;
      g.tiles_across = static_cast<uint16_t>(rect.x1 - rect.x0);
      tiles.push_back(culled ? TileRect{} : rect);
      projected.push_back(g);
      const size_t chunk = i / static_cast<size_t>(kProjectChunk);
      if (!culled) {
        visible[chunk * static_cast<size_t>(kProjectChunk) + static_cast<size_t>(visible_counts[chunk]++)] =
            static_cast<int32_t>(i);
      }
    }
  }

  SlotsParams Params() {
    return {.count = static_cast<int64_t>(tiles.size()),
            .tiles = tiles.data(),
            .visible = visible.data(),
            .visible_counts = visible_counts.data(),
            .tiles_x = kSlotTilesX,
            .tiles_y = kSlotTilesY,
            .first_tile = 0,
            .last_tile = kSlotTiles,
            .projected = projected.data()};
  }
};

// What a tile finds about a Gaussian: thirds, so that the order of an addition shows.
BlendGradient FoundInTile(int64_t i, int64_t tile) {
  const float q = static_cast<float>(1 + (i * 31 + tile * 17) % 101) / 3;
  return {q, 2 * q, -q, q * q, q / 7, 1 / q, {q + 1, q - 1, 3 * q}};
}
bool IsTouchedByTile(int64_t i, int64_t tile) { return (i + 3 * tile) % 4 != 0; }

struct SlotsAdded {
  std::vector<BlendGradient> gradients;
  std::vector<float> absolute;
};

SlotsAdded AddedOneByOne(const SlotScene& scene) {
  const size_t n = scene.tiles.size();
  SlotsAdded sums{std::vector<BlendGradient>(n), std::vector<float>(2 * n)};
  for (size_t i = 0; i < n; ++i) {
    for (int64_t tile = 0; tile < kSlotTiles; ++tile) {
      const auto row = static_cast<int64_t>(i);
      if (!CoversTile(scene.tiles[i], tile) || !IsTouchedByTile(row, tile)) continue;
      sums.gradients[i] += FoundInTile(row, tile);
      sums.absolute[2 * i] += FoundInTile(row, tile).q;
      sums.absolute[2 * i + 1] += FoundInTile(row, tile).quu;
    }
  }
  return sums;
}

// By slots, in runs of at most `max_slots`.
SlotsAdded AddedBySlots(SlotScene scene, int64_t max_slots, int& runs) {
  SlotsParams p = scene.Params();
  const size_t n = scene.tiles.size();
  SlotsAdded sums{std::vector<BlendGradient>(n, BlendGradient{9, 9, 9, 9, 9, 9, {9, 9, 9}}),
                  std::vector<float>(2 * n, 9)};
  std::vector<int64_t> starts(3);
  runs = 0;
  for (int64_t first = 0; first < kSlotTiles; first = p.last_tile, ++runs) {
    p.first_tile = first;
    p.last_tile = kSlotTiles;
    const auto count = static_cast<size_t>(PlaceSlots(p, max_slots, starts.data()));
    EXPECT_GT(p.last_tile, first);
    EXPECT_TRUE(static_cast<int64_t>(count) <= max_slots || p.last_tile == first + 1);
    std::vector<BlendGradient> slots(count, BlendGradient{7, 7, 7, 7, 7, 7, {7, 7, 7}});  // nobody clears them
    std::vector<float> absolute(2 * count, 7);
    std::vector<uint8_t> touched(count), taken(count);
    for (size_t i = 0; i < n; ++i) {
      const auto row = static_cast<int64_t>(i);
      const ProjectedGaussian& g = scene.projected[i];
      for (int64_t tile = first; tile < p.last_tile; ++tile) {
        if (!CoversTile(scene.tiles[i], tile)) continue;
        const int64_t slot = starts[i / static_cast<size_t>(kProjectChunk)] + g.slot +
                             (tile / kSlotTilesX - g.tile_y0) * g.tiles_across + (tile % kSlotTilesX - g.tile_x0);
        if (slot < 0 || slot >= static_cast<int64_t>(count)) {
          ADD_FAILURE() << "slot " << slot << " of " << count;
          continue;
        }
        const auto k = static_cast<size_t>(slot);
        EXPECT_EQ(taken[k]++, 0);
        if (!IsTouchedByTile(row, tile)) continue;
        slots[k] = FoundInTile(row, tile);
        absolute[2 * k] = FoundInTile(row, tile).q;
        absolute[2 * k + 1] = FoundInTile(row, tile).quu;
        touched[k] = 1;
      }
    }
    for (int64_t chunk = 0; chunk < ProjectChunks(p.count); ++chunk) {
      SumSlots(p, {starts.data(), slots.data(), absolute.data(), touched.data()}, chunk, first == 0,
               sums.gradients.data(), sums.absolute.data());
    }
  }
  return sums;
}

TEST(GradientSlots, TilesBeforeCountsThem) {
  for (const TileRect rect : {TileRect{0, 0, 1, 1}, TileRect{3, 2, 7, 5}, TileRect{0, 0, kSlotTilesX, kSlotTilesY},
                              TileRect{12, 8, 13, 9}, TileRect{5, 0, 6, 9}, TileRect{}}) {
    int64_t before = 0;
    for (int64_t tile = 0; tile <= kSlotTiles; ++tile) {
      EXPECT_EQ(TilesBefore(rect, tile, kSlotTilesX), before) << rect.x0 << " " << rect.y0 << " tile " << tile;
      before += tile < kSlotTiles && CoversTile(rect, tile);
    }
  }
}

TEST(GradientSlots, AddUpToTheBitInRunsOfAnyLength) {
  for (const uint64_t seed : {1, 2}) {
    const SlotScene scene(seed);
    const SlotsAdded expected = AddedOneByOne(scene);
    for (const int64_t max_slots : {int64_t{1} << 40, int64_t{2'000}, int64_t{1}}) {
      int runs = 0;
      const SlotsAdded sums = AddedBySlots(scene, max_slots, runs);
      EXPECT_EQ(runs == 1, max_slots > 2'000);
      EXPECT_EQ(runs == kSlotTiles, max_slots == 1);
      for (size_t i = 0; i < scene.tiles.size(); ++i) {
        if (scene.tiles[i].x1 == 0) continue;  // nothing is said about the invisible ones
        const BlendGradient &a = sums.gradients[i], &b = expected.gradients[i];
        ASSERT_EQ(a.q, b.q) << i;
        ASSERT_EQ(a.qu, b.qu);
        ASSERT_EQ(a.qv, b.qv);
        ASSERT_EQ(a.quu, b.quu);
        ASSERT_EQ(a.quv, b.quv);
        ASSERT_EQ(a.qvv, b.qvv);
        for (int c = 0; c < 3; ++c) ASSERT_EQ(a.rgb[c], b.rgb[c]);
        for (size_t k = 2 * i; k < 2 * i + 2; ++k) ASSERT_EQ(sums.absolute[k], expected.absolute[k]) << i;
      }
    }
  }
}

TEST(GradientSlots, NothingVisibleNeedsNone) {
  SlotScene scene(3);
  std::fill(scene.visible_counts.begin(), scene.visible_counts.end(), 0);
  SlotsParams p = scene.Params();
  std::vector<int64_t> starts(3, -1);
  EXPECT_EQ(PlaceSlots(p, 100, starts.data()), 0);
  EXPECT_EQ(starts, std::vector<int64_t>(3, 0));
  EXPECT_EQ(p.last_tile, kSlotTiles);
}

}  // namespace
}  // namespace anchorsplat
