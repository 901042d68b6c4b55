#include "core/kd_tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <span>
#include <utility>
#include <vector>

#include "core/random.h"

namespace anchorsplat {
namespace {

double SquaredDistance(const std::vector<float>& x, int64_t i, int64_t j) {
  double sum = 0;
  for (size_t k = 0; k < 3; ++k) {
    const double d = double{x[static_cast<size_t>(3 * i) + k]} - x[static_cast<size_t>(3 * j) + k];
    sum += d * d;
  }
  return sum;
}

// Against sorting all distances.
void ExpectNearest(const std::vector<float>& x, size_t count) {
  const KdTree tree(x);
  const auto n = static_cast<int64_t>(x.size() / 3);
  ASSERT_EQ(tree.size(), n);
  std::vector<bool> met(static_cast<size_t>(n), false);
  for (int64_t place = 0; place < n; ++place) {
    const int64_t i = tree.PointAt(place);
    met[static_cast<size_t>(i)] = true;
    std::vector<double> expected;
    for (int64_t j = 0; j < n; ++j) {
      if (j != i) expected.push_back(SquaredDistance(x, i, j));
    }
    std::sort(expected.begin(), expected.end());
    std::vector<KdTree::Neighbour> nearest(count);
    const int64_t found = tree.Nearest(place, nearest);
    ASSERT_EQ(found, std::min<int64_t>(static_cast<int64_t>(count), n - 1));
    for (size_t k = 0; k < static_cast<size_t>(found); ++k) {
      EXPECT_EQ(nearest[k].squared_distance, expected[k]) << "point " << i << ", neighbour " << k;
      EXPECT_NE(nearest[k].index, i);
      EXPECT_EQ(nearest[k].squared_distance, SquaredDistance(x, i, nearest[k].index));
      for (size_t l = 0; l < k; ++l) EXPECT_NE(nearest[k].index, nearest[l].index);
    }
  }
  EXPECT_TRUE(std::all_of(met.begin(), met.end(), [](bool b) { return b; }));
}

TEST(KdTree, MatchesSortingAllDistances) {
  Random random(1);
  for (const size_t n : {1u, 2u, 5u, 9u, 100u, 700u}) {
    std::vector<float> x(3 * n);
    for (float& v : x) v = static_cast<float>(random.Normal());
    ExpectNearest(x, 8);
  }
}

TEST(KdTree, MatchesSortingAllDistancesToMany) {
  Random random(3);
  for (const size_t n : {3u, 120u, 700u}) {
    std::vector<float> x(3 * n);
    for (float& v : x) v = static_cast<float>(random.Normal());
    ExpectNearest(x, 200);
  }
}

TEST(KdTree, AroundAnyPosition) {
  Random random(5);
  std::vector<float> x(3 * 500);
  for (float& v : x) v = static_cast<float>(random.Normal());
  const KdTree tree(x);
  for (int trial = 0; trial < 50; ++trial) {
    // A place of its own, or that of a point, which is found.
    std::array<float, 3> at = {x[0], x[1], x[2]};
    if (trial > 0) {
      for (float& v : at) v = static_cast<float>(2 * random.Normal());
    }
    std::vector<double> expected;
    for (size_t i = 0; i < 500; ++i) {
      double sum = 0;
      for (size_t k = 0; k < 3; ++k) sum += (double{x[3 * i + k]} - at[k]) * (double{x[3 * i + k]} - at[k]);
      expected.push_back(sum);
    }
    const std::vector<double> distances = expected;
    std::sort(expected.begin(), expected.end());
    std::array<KdTree::Neighbour, 9> nearest;
    ASSERT_EQ(tree.NearestTo(at, nearest), 9);
    for (size_t k = 0; k < 9; ++k) {
      EXPECT_DOUBLE_EQ(nearest[k].squared_distance, expected[k]);
      EXPECT_DOUBLE_EQ(nearest[k].squared_distance, distances[static_cast<size_t>(nearest[k].index)]);
    }
    if (trial == 0) {
      EXPECT_EQ(nearest[0].index, 0);
    }
  }
  std::array<KdTree::Neighbour, 9> nearest;
  EXPECT_EQ(KdTree(std::span(x).first(6)).NearestTo({0, 0, 0}, nearest), 2);
  EXPECT_EQ(KdTree(std::span<const float>()).NearestTo({0, 0, 0}, nearest), 0);
}

TEST(KdTree, FarOutliersAndSharedPlaces) {
  Random random(2);
  std::vector<float> x;
  for (int i = 0; i < 300; ++i) {
    for (int k = 0; k < 3; ++k) x.push_back(static_cast<float>(random.Below(3)));  // 27 places
  }
  for (const float far : {1e6f, -3e18f, 1e-30f}) x.insert(x.end(), {far, 0, far});
  ExpectNearest(x, 12);
  ExpectNearest(x, 150);
}

TEST(KdTree, ManyPointsAtOnePlaceAreNotAllVisited) {
  constexpr int64_t kPoints = 200'000;  // squared, this would take minutes
  const KdTree tree(std::vector<float>(3 * kPoints, 0.5f));
  std::vector<KdTree::Neighbour> nearest(8);
  for (int64_t place = 0; place < kPoints; ++place) ASSERT_EQ(tree.Nearest(place, nearest), 8);
  EXPECT_EQ(nearest.back().squared_distance, 0);
}

TEST(KdTree, BoxesHoldNoOtherPoints) {
  Random random(4);
  std::vector<float> x(3 * 5000);
  for (float& v : x) v = static_cast<float>(random.Normal());
  const KdTree tree(x);
  for (const int64_t place : {int64_t{0}, int64_t{1234}, int64_t{2500}, int64_t{4999}}) {
    const auto [first, last] = tree.BoxAround(place, 300);
    ASSERT_GT(last - first, 100);
    ASSERT_LE(last - first, 300);
    EXPECT_LE(first, place + 1);
    EXPECT_GE(last, place);
    std::array<float, 3> low, high;
    low.fill(1e9f), high.fill(-1e9f);
    for (int64_t at = first; at < last; ++at) {
      for (size_t a = 0; a < 3; ++a) {
        const float v = x[static_cast<size_t>(3 * tree.PointAt(at)) + a];
        low[a] = std::min(low[a], v), high[a] = std::max(high[a], v);
      }
    }
    int64_t inside = 0;
    for (size_t i = 0; i < x.size(); i += 3) {
      bool is_inside = true;
      for (size_t a = 0; a < 3; ++a) is_inside = is_inside && x[i + a] >= low[a] && x[i + a] <= high[a];
      inside += is_inside ? 1 : 0;
    }
    EXPECT_EQ(inside, last - first);
  }
  EXPECT_EQ(tree.BoxAround(7, 5000), (std::pair<int64_t, int64_t>(0, 5000)));
}

TEST(KdTree, Empty) { EXPECT_EQ(KdTree({}).size(), 0); }

}  // namespace
}  // namespace anchorsplat
