#include "published/spatial_blocks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/random.h"

namespace anchorsplat {
namespace {

std::vector<float> RandomPositions(uint64_t seed, int64_t count, double power) {
  Random random(seed);
  std::vector<float> positions(static_cast<size_t>(3 * count));
  for (auto& p : positions) p = static_cast<float>(std::pow(random.Uniform(), power));
  return positions;
}

TEST(SpatialBlocks, OneBlockWhenItFits) {
  const auto blocks = SplitIntoBlocks(RandomPositions(1, 50, 1), {0, 0, 0}, 1, {.most = 50});
  ASSERT_EQ(blocks.size(), 1u);
  EXPECT_EQ(blocks[0].rows.size(), 50u);
  EXPECT_EQ(blocks[0].side, 1);
  EXPECT_TRUE(SplitIntoBlocks({}, {0, 0, 0}, 1).empty());
}

TEST(SpatialBlocks, WeightsSumToOneAndNeighboursAreThere) {
  const SpatialBlockOptions options{.most = 100, .margin = 0.2};
  const auto positions = RandomPositions(2, 3000, 2);  // denser towards a corner
  const auto blocks = SplitIntoBlocks(positions, {0, 0, 0}, 1, options);
  EXPECT_GT(blocks.size(), 30u);
  std::vector<double> total(3000, 0);
  int64_t shared = 0;
  for (const SpatialBlock& block : blocks) {
    ASSERT_TRUE(std::is_sorted(block.rows.begin(), block.rows.end()));
    EXPECT_LE(block.rows.size(), 200u);
    for (size_t j = 0; j < block.rows.size(); ++j) {
      total[static_cast<size_t>(block.rows[j])] += block.weights[j];
      shared += block.weights[j] > 0 && block.weights[j] < 1;
      for (size_t axis = 0; axis < 3; ++axis) {
        const double p = positions[static_cast<size_t>(3 * block.rows[j]) + axis];
        EXPECT_GE(p, block.corner[axis] - 1e-9);
        EXPECT_LE(p, block.corner[axis] + block.side + 1e-9);
      }
    }
    for (int64_t row = 0; row < 3000; ++row) {
      bool inside = true;
      for (size_t axis = 0; axis < 3; ++axis) {
        const double p = positions[static_cast<size_t>(3 * row) + axis];
        inside = inside && p > block.corner[axis] + 1e-9 && p < block.corner[axis] + block.side - 1e-9;
      }
      if (inside) {
        EXPECT_TRUE(std::binary_search(block.rows.begin(), block.rows.end(), row));
      }
    }
  }
  EXPECT_GT(shared, 1000);
  for (const double t : total) EXPECT_NEAR(t, 1, 1e-6);
}

TEST(SpatialBlocks, ManyGaussiansAtOnePointStayBounded) {
  const std::vector<float> positions(3 * 1000, 0.3f);
  const auto blocks = SplitIntoBlocks(positions, {0, 0, 0}, 1, {.most = 64});
  ASSERT_EQ(blocks.size(), 16u);
  for (const SpatialBlock& block : blocks) EXPECT_LE(block.rows.size(), 128u);
}

}  // namespace
}  // namespace anchorsplat
