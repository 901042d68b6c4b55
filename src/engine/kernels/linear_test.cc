#include "kernels/linear.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "core/parallel.h"
#include "core/random.h"
#include "core/simd_targets_for_test.h"

namespace anchorsplat {
namespace {

std::vector<float> RandomFloats(Random& random, int64_t count, double size = 1) {
  std::vector<float> values(static_cast<size_t>(count));
  for (float& x : values) x = static_cast<float>(size * random.Normal());
  return values;
}

double Activated(Activation activation, double x) {
  switch (activation) {
    case Activation::kGelu:
      return x * 0.5 * (1 + std::erf(x / std::sqrt(2.0)));
    case Activation::kRelu:
      return x < 0 ? 0 : x;
    case Activation::kNone:
      break;
  }
  return x;
}

struct Layer {
  int64_t rows, inputs, outputs;
  Activation activation;
  std::vector<float> x, w, b, residual;
  WeightPrecision precision = WeightPrecision::kFloat;
};

// To 8 significant bits, ties to even.
double BFloat16(double x) {
  if (x == 0 || !std::isfinite(x)) return x;
  const double unit = std::ldexp(1.0, std::ilogb(x) - 7);
  return std::nearbyint(x / unit) * unit;
}

Layer RandomLayer(int64_t rows, int64_t inputs, int64_t outputs, Activation activation, bool residual) {
  Random random(static_cast<uint64_t>(rows * 7919 + inputs * 31 + outputs));
  return {.rows = rows,
          .inputs = inputs,
          .outputs = outputs,
          .activation = activation,
          .x = RandomFloats(random, rows * inputs),
          .w = RandomFloats(random, outputs * inputs, 1 / std::sqrt(static_cast<double>(inputs))),
          .b = RandomFloats(random, outputs),
          .residual = RandomFloats(random, residual ? rows * outputs : 0)};
}

std::vector<float> Apply(const Layer& l, bool in_place = false) {
  const PackedWeights weights(l.w.data(), l.b.data(), l.outputs, l.inputs, 1, l.precision);
  std::vector<float> out(static_cast<size_t>(l.rows * l.outputs), -77.0f);
  if (in_place) out = l.residual;
  LinearCpu({.rows = l.rows,
             .input = l.x.data(),
             .input_stride = l.inputs,
             .weights = &weights,
             .activation = l.activation,
             .residual = l.residual.empty() ? nullptr
                         : in_place         ? out.data()
                                            : l.residual.data(),
             .out = out.data(),
             .output_stride = l.outputs});
  return out;
}

double Reference(const Layer& l, int64_t row, int64_t column) {
  double sum = l.b[static_cast<size_t>(column)];
  for (int64_t k = 0; k < l.inputs; ++k) {
    const double x = l.x[static_cast<size_t>(row * l.inputs + k)];
    const double w = l.w[static_cast<size_t>(column * l.inputs + k)];
    sum += l.precision == WeightPrecision::kBFloat16 ? BFloat16(x) * BFloat16(w) : x * w;
  }
  sum = Activated(l.activation, sum);
  return l.residual.empty() ? sum : sum + l.residual[static_cast<size_t>(row * l.outputs + column)];
}

void ExpectReference(const Layer& l, const std::vector<float>& out) {
  const double tolerance = 5e-6 + 5e-7 * std::sqrt(static_cast<double>(l.inputs));  // fp32 sums drift like a walk
  for (int64_t row = 0; row < l.rows; ++row) {
    for (int64_t column = 0; column < l.outputs; ++column) {
      ASSERT_NEAR(out[static_cast<size_t>(row * l.outputs + column)], Reference(l, row, column), tolerance)
          << "row " << row << " of " << l.rows << ", column " << column << " of " << l.outputs << ", " << l.inputs
          << " inputs";
    }
  }
}

TEST(Linear, MatchesReferenceForEveryTileRemainder) {
  ForEachSimdTarget([] {
    for (int64_t rows = 1; rows <= 30; ++rows) {
      for (int64_t outputs : {1, 15, 16, 17, 32, 33, 48, 60, 80}) {
        const Layer l = RandomLayer(rows, 19, outputs, Activation::kNone, false);
        ExpectReference(l, Apply(l));
      }
    }
  });
}

TEST(Linear, MatchesReferenceInBFloat16) {
  ForEachSimdTarget([] {
    for (int64_t rows = 1; rows <= 30; ++rows) {
      for (int64_t outputs : {1, 16, 17, 32, 45, 80}) {
        for (int64_t inputs : {1, 18, 33}) {
          Layer l = RandomLayer(rows, inputs, outputs, Activation::kGelu, true);
          l.precision = WeightPrecision::kBFloat16;
          ExpectReference(l, Apply(l));
        }
      }
    }
  });
}

TEST(Linear, MatchesReferenceForActivationsAndResiduals) {
  ForEachSimdTarget([] {
    for (Activation activation : {Activation::kNone, Activation::kRelu, Activation::kGelu}) {
      for (bool residual : {false, true}) {
        for (int64_t outputs : {64, 45}) {
          const Layer l = RandomLayer(53, 64, outputs, activation, residual);
          ExpectReference(l, Apply(l));
          if (residual) ExpectReference(l, Apply(l, true));
        }
      }
    }
  });
}

// x·Φ(x) through a layer of one weight 1: every range of the approximation, and where it is cut off.
TEST(Linear, GeluIsExactToFloats) {
  ForEachSimdTarget([] {
    Layer l{.rows = 0,
            .inputs = 1,
            .outputs = 1,
            .activation = Activation::kGelu,
            .x = {},
            .w = {1},
            .b = {0},
            .residual = {}};
    for (double x = -12; x <= 12; x += 0.00917) l.x.push_back(static_cast<float>(x));
    for (float x : {0.0f, 1e-30f, -1e-30f, 1e30f, -1e30f, 5.656854f, -5.656854f}) l.x.push_back(x);
    l.rows = static_cast<int64_t>(l.x.size());
    const std::vector<float> out = Apply(l);
    for (size_t i = 0; i < out.size(); ++i) {
      const double x = l.x[i];
      ASSERT_NEAR(out[i], x * 0.5 * std::erfc(-x / std::sqrt(2.0)),
                  3e-7 * std::max(std::min(std::abs(x), 6.0), static_cast<double>(std::abs(out[i]))))
          << x;
    }
  });
}

TEST(Linear, ManyRowsAndDeepSums) {
  const Layer l = RandomLayer(700, 2048, 32, Activation::kGelu, true);
  ExpectReference(l, Apply(l));
}

TEST(Linear, NoRowsAndNoInputs) {
  const Layer none = RandomLayer(0, 8, 8, Activation::kNone, false);
  EXPECT_TRUE(Apply(none).empty());
  const Layer only_bias = RandomLayer(3, 0, 8, Activation::kNone, false);
  ExpectReference(only_bias, Apply(only_bias));
}

TEST(Linear, SameBitsForAnyNumberOfThreads) {
  for (WeightPrecision precision : {WeightPrecision::kFloat, WeightPrecision::kBFloat16}) {
    Layer l = RandomLayer(1000, 96, 96, Activation::kGelu, true);
    l.precision = precision;
    SetThreadCount(1);
    const std::vector<float> one = Apply(l);
    for (int threads : {2, 5}) {
      SetThreadCount(threads);
      const std::vector<float> many = Apply(l);
      EXPECT_EQ(0, std::memcmp(one.data(), many.data(), one.size() * sizeof(float))) << threads;
    }
  }
  SetThreadCount(0);
}

TEST(Linear, NanStaysInItsRow) {
  ForEachSimdTarget([] {
    for (WeightPrecision precision : {WeightPrecision::kFloat, WeightPrecision::kBFloat16}) {
      for (Activation activation : {Activation::kNone, Activation::kRelu, Activation::kGelu}) {
        Layer l = RandomLayer(20, 16, 24, activation, true);
        l.precision = precision;
        l.x[5 * 16 + 3] = std::numeric_limits<float>::quiet_NaN();
        const std::vector<float> out = Apply(l);
        for (size_t i = 0; i < out.size(); ++i) ASSERT_EQ(std::isnan(out[i]), i / 24 == 5) << i;
      }
    }
  });
}

}  // namespace
}  // namespace anchorsplat
