#include "fit/nearest_neighbours.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "core/parallel.h"
#include "core/random.h"

namespace anchorsplat {
namespace {

std::vector<float> Reference(const std::vector<float>& p) {
  std::vector<float> out;
  for (size_t i = 0; i < p.size(); i += 3) {
    std::vector<double> all;
    for (size_t j = 0; j < p.size(); j += 3) {
      double sum = 0;
      for (size_t k = 0; k < 3; ++k) sum += (double{p[i + k]} - p[j + k]) * (double{p[i + k]} - p[j + k]);
      if (i != j) all.push_back(sum);
    }
    std::sort(all.begin(), all.end());
    all.resize(std::min<size_t>(3, all.size()));
    double sum = 0;
    for (const double d : all) sum += d;
    out.push_back(all.empty() ? 0.0f : static_cast<float>(sum / static_cast<double>(all.size())));
  }
  return out;
}

void ExpectMatches(const std::vector<float>& positions) {
  const Buffer<float> got = MeanSquaredNeighbourDistance(positions);
  const std::vector<float> expected = Reference(positions);
  ASSERT_EQ(got.size(), expected.size());
  for (size_t i = 0; i < got.size(); ++i) ASSERT_FLOAT_EQ(got[i], expected[i]) << i;
}

TEST(NearestNeighbours, MatchesReference) {
  for (const size_t n : {1, 2, 3, 4, 5, 8, 9, 17, 100, 701}) {
    Random random(n);
    std::vector<float> uniform, clustered, grid;
    for (size_t i = 0; i < n; ++i) {
      const double far = i % 10 == 9 ? 1e4 : 1.0, cluster = static_cast<double>(i % 3);
      for (size_t k = 0; k < 3; ++k) {
        uniform.push_back(static_cast<float>(random.Uniform(-1, 1)));
        clustered.push_back(static_cast<float>(far * (cluster + 0.001 * random.Normal())));
        grid.push_back(static_cast<float>(random.Below(4)));  // ties and coinciding points
      }
    }
    ExpectMatches(uniform);
    ExpectMatches(clustered);
    ExpectMatches(grid);
  }
}

TEST(NearestNeighbours, FlatAndEqualPoints) {
  EXPECT_TRUE(MeanSquaredNeighbourDistance({}).empty());
  const std::vector<float> equal(3 * 1000, 2.5f);
  for (const float d : MeanSquaredNeighbourDistance(equal)) ASSERT_EQ(d, 0);
  std::vector<float> line;
  for (int i = 0; i < 300; ++i) line.insert(line.end(), {static_cast<float>(i), 0.0f, 0.0f});
  ExpectMatches(line);
}

TEST(NearestNeighbours, SameBitsForAnyNumberOfThreads) {
  Random random(3);
  std::vector<float> positions(3 * 5000);
  for (float& x : positions) x = static_cast<float>(random.Normal());
  SetThreadCount(1);
  const Buffer<float> one = MeanSquaredNeighbourDistance(positions);
  SetThreadCount(5);
  EXPECT_EQ(MeanSquaredNeighbourDistance(positions), one);
  SetThreadCount(0);
}

}  // namespace
}  // namespace anchorsplat
