#include "kernels/level.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <vector>

#include "core/random.h"

namespace anchorsplat {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::vector<int32_t> RandomVoxels(uint64_t seed, int64_t count, int64_t side) {
  Random random(seed);
  std::vector<int32_t> voxels(static_cast<size_t>(3 * count));
  for (auto& v : voxels) v = static_cast<int32_t>(random.Below(side));
  return voxels;
}

TEST(Level, PoolingMergesWhatSharesACoarseVoxel) {
  const std::vector<int32_t> voxels = RandomVoxels(4, 5000, 60);
  const auto levels = BuildHierarchy(voxels, {.shuffles = ShufflesFromSeed(5)});
  ASSERT_TRUE(levels.ok());
  ASSERT_EQ(levels->size(), 5u);
  const int dropped[] = {0, 1, 1, 1};
  for (size_t s = 0; s + 1 < levels->size(); ++s) {
    const Level &fine = (*levels)[s], &coarse = (*levels)[s + 1];
    std::set<std::vector<int32_t>> distinct;
    for (size_t i = 0; i < static_cast<size_t>(fine.count); ++i) {
      const size_t cluster = static_cast<size_t>(fine.cluster[i]);
      std::vector<int32_t> voxel;
      for (size_t axis = 0; axis < 3; ++axis) {
        voxel.push_back(fine.voxels[3 * i + axis] >> dropped[s]);
        ASSERT_EQ(coarse.voxels[3 * cluster + axis], voxel.back());
      }
      distinct.insert(voxel);
    }
    EXPECT_EQ(static_cast<size_t>(coarse.count), distinct.size());
    std::vector<int64_t> code_of_cluster(distinct.size());
    for (size_t i = 0; i < static_cast<size_t>(fine.count); ++i) {
      code_of_cluster[static_cast<size_t>(fine.cluster[i])] = fine.codes[0][i] >> (3 * dropped[s]);
    }
    EXPECT_TRUE(std::is_sorted(code_of_cluster.begin(), code_of_cluster.end()));
  }
}

TEST(Level, CodesOfPooledLevelsAreThoseOfTheirVoxels) {
  const Shuffles shuffles = ShufflesFromSeed(7);
  const auto levels = BuildHierarchy(RandomVoxels(6, 800, 200), {.shuffles = shuffles});
  ASSERT_TRUE(levels.ok());
  Shuffle curve_of_slot = kNoShuffle;
  for (size_t s = 0; s < levels->size(); ++s) {
    const Level& level = (*levels)[s];
    Shuffle next;
    for (size_t slot = 0; slot < next.size(); ++slot) next[slot] = curve_of_slot[shuffles[s][slot]];
    curve_of_slot = next;
    for (size_t slot = 0; slot < next.size(); ++slot) {
      std::vector<int64_t> expected(static_cast<size_t>(level.count));
      CurveCodes(static_cast<Curve>(curve_of_slot[slot]), level.depth, level.voxels, expected);
      ASSERT_THAT(level.codes[slot], testing::ElementsAreArray(expected)) << "level " << s << " slot " << slot;
      for (size_t i = 0; i < static_cast<size_t>(level.count); ++i) {
        ASSERT_EQ(level.patch_rows[slot][static_cast<size_t>(level.positions[slot][i])], static_cast<int32_t>(i));
      }
    }
  }
}

TEST(Level, DegenerateClouds) {
  const auto none = BuildHierarchy({});
  ASSERT_TRUE(none.ok());
  EXPECT_EQ(none->size(), 5u);
  EXPECT_EQ(none->back().count, 0);

  const std::vector<int32_t> same = {0, 0, 0, 0, 0, 0, 0, 0, 0};
  const auto one_voxel = BuildHierarchy(same);
  ASSERT_TRUE(one_voxel.ok());
  EXPECT_EQ((*one_voxel)[0].count, 3);
  for (size_t s = 1; s < 5; ++s) EXPECT_EQ((*one_voxel)[s].count, 1);

  // Bits run out after one halving: the later poolings merge nothing more.
  const std::vector<int32_t> two = {0, 0, 0, 1, 1, 1};
  const auto shallow = BuildHierarchy(two);
  ASSERT_TRUE(shallow.ok());
  EXPECT_EQ((*shallow)[1].count, 2);
  EXPECT_EQ((*shallow)[2].count, 1);
  EXPECT_EQ((*shallow)[4].count, 1);
  EXPECT_THAT((*shallow)[0].cluster, ElementsAre(0, 1));
}

TEST(Level, RefusesWhatItCannotHold) {
  const std::vector<int32_t> negative = {0, -1, 0}, huge = {0, 0, (1 << 20) + 1};
  EXPECT_THAT(BuildHierarchy(negative).error().message, HasSubstr("found -1"));
  EXPECT_FALSE(BuildHierarchy(huge).ok());
  EXPECT_THAT(BuildHierarchy({}, {.strides = {3}}).error().message, HasSubstr("power of two"));
  EXPECT_THAT(BuildHierarchy({}, {.strides = {1, 1, 1, 1, 1}}).error().message, HasSubstr("5 poolings"));
}

}  // namespace
}  // namespace anchorsplat
