#include "kernels/voxel_neighbours.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "core/random.h"

namespace anchorsplat {
namespace {

// The rule, written down by looking at every pair.
std::vector<int32_t> Reference(const std::vector<int32_t>& voxels) {
  const int n = static_cast<int>(voxels.size() / 3);
  const auto same = [&](int j, int x, int y, int z) {
    const size_t at = static_cast<size_t>(3 * j);
    return voxels[at] == x && voxels[at + 1] == y && voxels[at + 2] == z;
  };
  const auto winner = [&](int x, int y, int z) {
    for (int j = n - 1; j >= 0; --j) {
      if (same(j, x, y, z)) return j;
    }
    return -1;
  };
  std::vector<int32_t> table;
  for (int i = 0; i < n; ++i) {
    const size_t at = static_cast<size_t>(3 * i);
    const int x = voxels[at], y = voxels[at + 1], z = voxels[at + 2];
    for (int k = 0; k < 27; ++k) {
      const int found = winner(x + k / 9 - 1, y + k / 3 % 3 - 1, z + k % 3 - 1);
      table.push_back(k == 13 ? i : k > 13 && winner(x, y, z) != i ? -1 : found);
    }
  }
  return table;
}

TEST(VoxelNeighbours, MatchesReference) {
  Random random(3);
  for (const int64_t side : {1, 2, 5, 9}) {  // from all in one voxel to mostly alone
    std::vector<int32_t> voxels(3 * 300);
    for (auto& v : voxels) v = static_cast<int32_t>(random.Below(side));
    EXPECT_THAT(VoxelNeighbours(voxels), testing::ElementsAreArray(Reference(voxels))) << side;
  }
}

TEST(VoxelNeighbours, WinnerIsTheLargestRowAndOthersSeeHalf) {
  const std::vector<int32_t> voxels = {4, 4, 4, 4, 4, 4, 4, 4, 5, 4, 4, 3, 4, 4, 3};
  const Buffer<int32_t> table = VoxelNeighbours(voxels);
  EXPECT_EQ(table[0 * 27 + 12], 4) << "z − 1 holds rows 3 and 4";
  EXPECT_EQ(table[1 * 27 + 12], 4);
  EXPECT_EQ(table[0 * 27 + 14], kNoNeighbour) << "row 0 is not the winner of its voxel";
  EXPECT_EQ(table[1 * 27 + 14], 2);
  EXPECT_EQ(table[0 * 27 + 13], 0);
}

TEST(VoxelNeighbours, NothingBeyondTheGrid) {
  const std::vector<int32_t> voxels = {0, 0, 0, 1 << 20, 1 << 20, 1 << 20, 0, 1 << 20, 0};
  const Buffer<int32_t> table = VoxelNeighbours(voxels);
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 27; ++k) EXPECT_EQ(table[static_cast<size_t>(27 * i + k)], k == 13 ? i : kNoNeighbour);
  }
  EXPECT_TRUE(VoxelNeighbours({}).empty());
}

}  // namespace
}  // namespace anchorsplat
