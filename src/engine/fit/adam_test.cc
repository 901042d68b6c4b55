#include "fit/adam.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/parallel.h"
#include "core/random.h"

namespace anchorsplat {
namespace {

struct Arrays {
  std::vector<float> gradient, first_moment, second_moment, values;
};

Arrays RandomArrays(size_t n, uint64_t seed) {
  Random random(seed);
  Arrays a;
  for (auto* array : {&a.gradient, &a.first_moment, &a.values}) {
    array->resize(n);
    for (float& x : *array) x = static_cast<float>(random.Normal() * std::pow(10.0, random.Uniform(-6, 1)));
  }
  a.second_moment.resize(n);
  for (float& x : a.second_moment) x = static_cast<float>(std::pow(10.0, random.Uniform(-12, 2)));
  return a;
}

AdamParams Params(Arrays& a, int64_t rows, int64_t stride, int64_t columns, int64_t first_columns, int64_t step) {
  return {rows,
          stride,
          columns,
          first_columns,
          2.5e-3f,
          1.25e-4f,
          0.9,
          0.999,
          1e-15f,
          step,
          a.gradient.data(),
          a.first_moment.data(),
          a.second_moment.data(),
          a.values.data()};
}

// As PyTorch's documentation of torch.optim.Adam writes it, in double.
void Reference(const AdamParams& p, Arrays& a) {
  const double t = static_cast<double>(p.step);
  for (int64_t row = 0; row < p.rows; ++row) {
    for (int64_t column = 0; column < p.columns; ++column) {
      const auto i = static_cast<size_t>(row * p.stride + column);
      const double rate = column < p.first_columns ? p.first_rate : p.rate, g = a.gradient[i];
      const double m = p.beta1 * a.first_moment[i] + (1 - p.beta1) * g;
      const double v = p.beta2 * a.second_moment[i] + (1 - p.beta2) * g * g;
      const double m_hat = m / (1 - std::pow(p.beta1, t)), v_hat = v / (1 - std::pow(p.beta2, t));
      a.first_moment[i] = static_cast<float>(m);
      a.second_moment[i] = static_cast<float>(v);
      a.values[i] = static_cast<float>(a.values[i] - rate * m_hat / (std::sqrt(v_hat) + double{p.epsilon}));
    }
  }
}

void ExpectClose(const std::vector<float>& got, const std::vector<float>& expected, double relative, double absolute) {
  ASSERT_EQ(got.size(), expected.size());
  for (size_t i = 0; i < got.size(); ++i) {
    ASSERT_NEAR(got[i], expected[i], relative * std::abs(double{expected[i]}) + absolute) << i;
  }
}

TEST(Adam, MatchesReferenceForEveryShape) {
  struct Shape {
    int64_t rows, stride, columns, first_columns;
  };
  // Spherical harmonics of each degree in use, and the other attributes; sizes that divide nothing.
  for (const Shape& s : {Shape{37, 48, 3, 3},
                         {37, 48, 12, 3},
                         {37, 48, 27, 3},
                         {701, 48, 48, 3},
                         {1009, 3, 3, 0},
                         {11, 4, 4, 0},
                         {3001, 1, 1, 0},
                         {5, 27, 27, 3},
                         {1, 1, 1, 1}}) {
    for (const int64_t step : {1, 2, 1000, 15000}) {
      const auto n = static_cast<size_t>(s.rows * s.stride);
      Arrays got = RandomArrays(n, n + static_cast<size_t>(step)), expected = got;
      AdamStep(Params(got, s.rows, s.stride, s.columns, s.first_columns, step));
      Reference(Params(expected, s.rows, s.stride, s.columns, s.first_columns, step), expected);
      ExpectClose(got.first_moment, expected.first_moment, 1e-6, 1e-7);
      ExpectClose(got.second_moment, expected.second_moment, 1e-6, 0);
      ExpectClose(got.values, expected.values, 1e-6, 1e-6);
    }
  }
}

TEST(Adam, ColumnsThatAreNotInUseStay) {
  Arrays a = RandomArrays(10 * 48, 3);
  const Arrays before = a;
  AdamStep(Params(a, 10, 48, 12, 3, 7));
  for (size_t i = 0; i < a.values.size(); ++i) {
    EXPECT_TRUE(a.values[i] == before.values[i] || i % 48 < 12) << i;  // a large one may not feel a small step
    EXPECT_EQ(a.first_moment[i] != before.first_moment[i], i % 48 < 12) << i;
    EXPECT_EQ(a.second_moment[i] != before.second_moment[i], i % 48 < 12) << i;
  }
}

TEST(Adam, NothingHappensWithoutAGradientEver) {
  Arrays a = RandomArrays(33, 4);
  std::fill(a.gradient.begin(), a.gradient.end(), 0.0f);
  std::fill(a.first_moment.begin(), a.first_moment.end(), 0.0f);
  std::fill(a.second_moment.begin(), a.second_moment.end(), 0.0f);
  const Arrays before = a;
  for (int64_t step = 1; step < 5; ++step) AdamStep(Params(a, 33, 1, 1, 0, step));
  EXPECT_EQ(a.values, before.values);
}

TEST(Adam, TheFirstStepGoesTheRateWhateverTheGradientsSize) {
  Arrays a;
  a.gradient = {1e-6f, -1e-6f, 3, -1e6f};
  a.first_moment = a.second_moment = a.values = {0, 0, 0, 0};
  AdamStep(Params(a, 4, 1, 1, 0, 1));
  for (size_t i = 0; i < 4; ++i) EXPECT_NEAR(a.values[i], a.gradient[i] > 0 ? -1.25e-4 : 1.25e-4, 1e-9);
}

TEST(Adam, NoRowsNoColumns) {
  Arrays a = RandomArrays(4, 1);
  const Arrays before = a;
  AdamStep(Params(a, 0, 4, 4, 0, 1));
  AdamStep(Params(a, 1, 4, 0, 0, 1));
  EXPECT_EQ(a.values, before.values);
}

TEST(Adam, SpoiledNumbersStayAmongThemselves) {
  Arrays a = RandomArrays(50, 9);
  a.gradient[20] = NAN;
  a.gradient[21] = INFINITY;
  AdamStep(Params(a, 50, 1, 1, 0, 1));
  for (size_t i = 0; i < 50; ++i) EXPECT_EQ(std::isfinite(a.values[i]), i != 20 && i != 21) << i;
}

TEST(Adam, SameBitsForAnyNumberOfThreads) {
  Arrays expected;
  for (const int threads : {1, 2, 5}) {
    SetThreadCount(threads);
    Arrays a = RandomArrays(5000 * 48, 8);
    AdamStep(Params(a, 5000, 48, 48, 3, 3));
    AdamStep(Params(a, 5000, 48, 27, 3, 4));
    if (threads == 1) {
      expected = a;
      continue;
    }
    EXPECT_EQ(a.values, expected.values) << threads;
    EXPECT_EQ(a.second_moment, expected.second_moment) << threads;
  }
  SetThreadCount(0);
}

}  // namespace
}  // namespace anchorsplat
