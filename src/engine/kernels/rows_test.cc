#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/random.h"
#include "kernels/layer_norm.h"
#include "kernels/pooling.h"

namespace anchorsplat {
namespace {

std::vector<float> RandomValues(Random& random, int64_t count, double offset = 0) {
  std::vector<float> values(static_cast<size_t>(count));
  for (float& v : values) v = static_cast<float>(offset + random.Normal());
  return values;
}

double Gelu(double x) { return 0.5 * x * (1 + std::erf(x / std::sqrt(2.0))); }

TEST(LayerNorm, MatchesReference) {
  Random random(11);
  for (const int64_t channels : {1, 7, 16, 64, 96, 133}) {
    const int64_t rows = 37;
    // A mean far from zero: one-pass variance would fail here.
    const auto x = RandomValues(random, rows * channels, 100), weight = RandomValues(random, channels),
               bias = RandomValues(random, channels), add = RandomValues(random, rows * channels);
    for (const bool with_add : {false, true}) {
      std::vector<float> out = add;
      LayerNormCpu({.rows = rows,
                    .channels = channels,
                    .input = x.data(),
                    .weight = weight.data(),
                    .bias = bias.data(),
                    .add = with_add ? out.data() : nullptr,
                    .out = out.data()});
      for (int64_t r = 0; r < rows; ++r) {
        double mean = 0, variance = 0;
        for (int64_t c = 0; c < channels; ++c) mean += x[static_cast<size_t>(r * channels + c)];
        mean /= static_cast<double>(channels);
        for (int64_t c = 0; c < channels; ++c) variance += std::pow(x[static_cast<size_t>(r * channels + c)] - mean, 2);
        variance /= static_cast<double>(channels);
        for (int64_t c = 0; c < channels; ++c) {
          const auto i = static_cast<size_t>(r * channels + c);
          const auto k = static_cast<size_t>(c);
          const double expected =
              (x[i] - mean) / std::sqrt(variance + 1e-5) * weight[k] + bias[k] + (with_add ? add[i] : 0);
          ASSERT_NEAR(out[i], expected, 1e-4) << channels;
        }
      }
    }
  }
}

TEST(LayerNorm, KeepsNanInItsRow) {
  std::vector<float> x(3 * 20, 1.0f), weight(20, 1.0f), bias(20, 0.5f);
  x[25] = std::numeric_limits<float>::quiet_NaN();
  LayerNormCpu(
      {.rows = 3, .channels = 20, .input = x.data(), .weight = weight.data(), .bias = bias.data(), .out = x.data()});
  EXPECT_EQ(x[0], 0.5f) << "a constant row has no variance";
  EXPECT_TRUE(std::isnan(x[20]));
  EXPECT_EQ(x[40], 0.5f);
}

TEST(ClusterMax, MatchesReference) {
  Random random(12);
  for (const int64_t channels : {3, 16, 40}) {
    const int64_t fine = 500, coarse = 90;
    std::vector<int32_t> cluster;
    for (int64_t i = 0; i < fine; ++i) {
      cluster.push_back(static_cast<int32_t>(i < coarse ? coarse - 1 - i : random.Below(coarse)));
    }
    const auto x = RandomValues(random, fine * channels), scale = RandomValues(random, channels),
               shift = RandomValues(random, channels);
    std::vector<float> out(static_cast<size_t>(coarse * channels));
    ClusterMaxCpu({.fine_count = fine,
                   .coarse_count = coarse,
                   .channels = channels,
                   .input = x.data(),
                   .cluster = cluster.data(),
                   .scale = scale.data(),
                   .shift = shift.data(),
                   .out = out.data()});
    for (int64_t m = 0; m < coarse; ++m) {
      for (int64_t c = 0; c < channels; ++c) {
        float largest = -std::numeric_limits<float>::infinity();
        for (int64_t i = 0; i < fine; ++i) {
          if (cluster[static_cast<size_t>(i)] == m)
            largest = std::max(largest, x[static_cast<size_t>(i * channels + c)]);
        }
        const auto k = static_cast<size_t>(c);
        ASSERT_NEAR(out[static_cast<size_t>(m * channels + c)], Gelu(double{largest} * scale[k] + shift[k]), 2e-6);
      }
    }
  }
}

TEST(ClusterMax, NanIsNotHiddenByNeighbours) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<float> x = {1, nan, nan, 2, 3, 4}, one = {1, 1}, zero = {0, 0};
  const std::vector<int32_t> cluster = {0, 0, 0};
  float out[2];
  ClusterMaxCpu({.fine_count = 3,
                 .coarse_count = 1,
                 .channels = 2,
                 .input = x.data(),
                 .cluster = cluster.data(),
                 .scale = one.data(),
                 .shift = zero.data(),
                 .out = out});
  EXPECT_TRUE(std::isnan(out[0]));
  EXPECT_TRUE(std::isnan(out[1]));
}

TEST(ClusterAdd, GathersTheCoarseRow) {
  std::vector<float> skip = {1, 2, 3, 4, 5, 6};
  const std::vector<float> coarse = {10, 20, 30, 40};
  const std::vector<int32_t> cluster = {1, 0, 1};
  ClusterAddCpu({.fine_count = 3,
                 .channels = 2,
                 .skip = skip.data(),
                 .coarse = coarse.data(),
                 .cluster = cluster.data(),
                 .out = skip.data()});
  EXPECT_THAT(skip, testing::ElementsAre(31, 42, 13, 24, 35, 46));
}

}  // namespace
}  // namespace anchorsplat
