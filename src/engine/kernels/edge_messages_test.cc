#include "kernels/edge_messages.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/random.h"
#include "core/simd_targets_for_test.h"

namespace anchorsplat {
namespace {

struct Sizes {
  int64_t points, neighbours, channels;
};

std::vector<float> Normals(Random& random, int64_t count) {
  std::vector<float> values(static_cast<size_t>(count));
  for (float& v : values) v = static_cast<float>(2 * random.Normal());
  return values;
}

TEST(EdgeMessages, SumGeluMatchesTheFormula) {
  for (const Sizes& s : {Sizes{1, 1, 16}, Sizes{5, 3, 48}, Sizes{7, 8, 64}, Sizes{3, 0, 16}}) {
    Random random(1);
    const int64_t all = s.points + 4;
    const auto own = Normals(random, s.points * s.channels), other = Normals(random, all * s.channels),
               edges = Normals(random, s.points * s.neighbours * s.channels);
    std::vector<int32_t> index(static_cast<size_t>(s.points * s.neighbours));
    for (int32_t& j : index) j = static_cast<int32_t>(random.Below(all));
    ForEachSimdTarget([&] {
      std::vector<float> out = edges;
      EdgeSumGeluCpu({s.points, s.neighbours, s.channels, own.data(), other.data(), index.data(), out.data()});
      for (size_t e = 0; e < index.size(); ++e) {
        for (size_t c = 0; c < static_cast<size_t>(s.channels); ++c) {
          const size_t width = static_cast<size_t>(s.channels);
          const double x = double{edges[e * width + c]} + own[e / static_cast<size_t>(s.neighbours) * width + c] +
                           other[static_cast<size_t>(index[e]) * width + c];
          EXPECT_NEAR(out[e * width + c], 0.5 * x * (1 + std::erf(x / std::sqrt(2.0))), 4e-6);
        }
      }
    });
  }
}

TEST(EdgeMessages, PoolsMaximumAndMean) {
  for (const Sizes& s : {Sizes{1, 1, 16}, Sizes{5, 3, 48}, Sizes{2, 0, 16}}) {
    Random random(2);
    const auto edges = Normals(random, s.points * s.neighbours * s.channels);
    const int64_t stride = 3 * s.channels;
    std::vector<float> out(static_cast<size_t>(s.points * stride), 7.0f);
    EdgePoolCpu({s.points, s.neighbours, s.channels, edges.data(), stride, out.data()});
    for (int64_t i = 0; i < s.points; ++i) {
      for (int64_t c = 0; c < s.channels; ++c) {
        double maximum = s.neighbours > 0 ? -1e9 : 0, sum = 0;
        for (int64_t k = 0; k < s.neighbours; ++k) {
          const double x = edges[static_cast<size_t>((i * s.neighbours + k) * s.channels + c)];
          maximum = std::max(maximum, x);
          sum += x / static_cast<double>(s.neighbours);
        }
        EXPECT_EQ(out[static_cast<size_t>(i * stride + c)], static_cast<float>(maximum));
        EXPECT_NEAR(out[static_cast<size_t>(i * stride + s.channels + c)], sum, 1e-6);
        EXPECT_EQ(out[static_cast<size_t>(i * stride + 2 * s.channels + c)], 7.0f);  // not ours
      }
    }
  }
}

}  // namespace
}  // namespace anchorsplat
