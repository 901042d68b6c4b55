#include "formats/sog/scalar_codebook.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/random.h"

namespace anchorsplat {
namespace {

double Distortion(const ScalarCodebook& codebook, const std::vector<float>& values) {
  double sum = 0;
  for (const float x : values) sum += std::pow(x - codebook.values[codebook.IndexOf(x)], 2);
  return sum;
}

TEST(ScalarCodebook, FewValuesAreKept) {
  const std::vector<float> values = {3, 1, 2, 2, 2, 1, std::nanf(""), std::numeric_limits<float>::infinity()};
  const ScalarCodebook codebook = BuildScalarCodebook(values.data(), 8, 1, 1);
  for (const float x : {1.0f, 2.0f, 3.0f}) EXPECT_EQ(codebook.values[codebook.IndexOf(x)], x);
  EXPECT_EQ(codebook.values[codebook.IndexOf(1e9f)], 3);
  EXPECT_EQ(codebook.values[codebook.IndexOf(-std::numeric_limits<float>::infinity())], 1);
  EXPECT_EQ(codebook.IndexOf(std::nanf("")), 0);
  const float one = 5;
  EXPECT_EQ(BuildScalarCodebook(&one, 1, 1, 1).values[0], 5);
  EXPECT_EQ(BuildScalarCodebook(&values[6], 1, 1, 1).values[0], 0);
}

// Plain k-means from quantiles, until nothing changes: a local optimum that the exact solution must not be behind.
TEST(ScalarCodebook, AtLeastAsGoodAsLloyd) {
  for (const uint64_t seed : {1, 2, 3}) {
    Random random(seed);
    std::vector<float> values(30'000);
    for (float& x : values) x = static_cast<float>(std::exp(random.Normal()) * (seed == 3 ? random.Normal() : 1.0));
    std::vector<float> sorted = values;
    std::sort(sorted.begin(), sorted.end());
    ScalarCodebook lloyd;
    for (size_t k = 0; k < 256; ++k) lloyd.values[k] = sorted[(2 * k + 1) * sorted.size() / 512];
    for (int round = 0; round < 300; ++round) {
      std::vector<double> sum(256), count(256);
      for (const float x : values) {
        sum[lloyd.IndexOf(x)] += x;
        ++count[lloyd.IndexOf(x)];
      }
      for (size_t k = 0; k < 256; ++k) {
        if (count[k] > 0) lloyd.values[k] = static_cast<float>(sum[k] / count[k]);
      }
    }
    const ScalarCodebook ours = BuildScalarCodebook(values.data(), 10'000, 3, 3);
    EXPECT_LT(Distortion(ours, values), 1.02 * Distortion(lloyd, values)) << seed;
  }
}

TEST(ScalarCodebook, OneOutlierDoesNotTakeTheResolution) {
  std::vector<float> values(10'000);
  Random random(4);
  for (float& x : values) x = static_cast<float>(random.Normal());
  values[17] = 1e6f;
  const ScalarCodebook codebook = BuildScalarCodebook(values.data(), 10'000, 1, 1);
  EXPECT_GT(codebook.values.back(), 1e5f);
  values.erase(values.begin() + 17);
  EXPECT_LT(Distortion(codebook, values) / 10'000, 0.1);
}

}  // namespace
}  // namespace anchorsplat
