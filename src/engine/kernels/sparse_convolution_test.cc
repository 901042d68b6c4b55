#include "kernels/sparse_convolution.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "core/parallel.h"
#include "core/random.h"
#include "core/simd_targets_for_test.h"
#include "kernels/voxel_neighbours.h"

namespace anchorsplat {
namespace {

struct Convolution {
  int64_t count, inputs, outputs;
  std::vector<int32_t> voxels = {};
  Buffer<int32_t> neighbours = {};
  std::vector<float> x = {}, w = {}, b = {};
  WeightPrecision precision = WeightPrecision::kFloat;
};

// Points in a cube of `side` voxels, with its far corner and the grid's: small sides make duplicates.
Convolution RandomConvolution(int64_t count, int64_t inputs, int64_t outputs, int64_t side) {
  Random random(static_cast<uint64_t>(count * 131 + inputs + outputs));
  Convolution c{.count = count, .inputs = inputs, .outputs = outputs};
  for (int64_t i = 0; i < 3 * count; ++i) {
    const auto v = static_cast<int32_t>(random.Below(side));
    c.voxels.push_back(i < 3 * count / 2 ? v : 384 - v);  // both ends of the grid
  }
  c.neighbours = VoxelNeighbours(c.voxels);
  const auto fill = [&](std::vector<float>& values, int64_t n, double size) {
    values.resize(static_cast<size_t>(n));
    for (float& v : values) v = static_cast<float>(size * random.Normal());
  };
  fill(c.x, count * inputs, 1);
  fill(c.w, outputs * kNeighbours * inputs, 1 / std::sqrt(27.0 * static_cast<double>(inputs)));
  fill(c.b, outputs, 1);
  return c;
}

std::vector<float> Convolve(const Convolution& c) {
  const PackedWeights weights(c.w.data(), c.b.data(), c.outputs, c.inputs, kNeighbours, c.precision);
  std::vector<float> out(static_cast<size_t>(c.count * c.outputs), -77.0f);
  SparseConvolutionCpu({.count = c.count,
                        .input = c.x.data(),
                        .neighbours = c.neighbours.data(),
                        .weights = &weights,
                        .out = out.data()});
  return out;
}

// To 8 significant bits, ties to even.
double BFloat16(double x) {
  if (x == 0) return x;
  const double unit = std::ldexp(1.0, std::ilogb(x) - 7);
  return std::nearbyint(x / unit) * unit;
}

// Straight from the voxels, without the neighbour table: out(p) = b + Σ_δ W_δ · in(winner of voxel(p) + δ).
double Reference(const Convolution& c, int64_t i, int64_t channel) {
  const auto winner = [&](int32_t x, int32_t y, int32_t z) {
    for (int64_t j = c.count - 1; j >= 0; --j) {
      const int32_t* v = c.voxels.data() + 3 * j;
      if (v[0] == x && v[1] == y && v[2] == z) return j;
    }
    return int64_t{-1};
  };
  const int32_t* v = c.voxels.data() + 3 * i;
  double sum = c.b[static_cast<size_t>(channel)];
  for (int k = 0; k < 27; ++k) {
    int64_t source = k == 13 ? i : winner(v[0] + k / 9 - 1, v[1] + k / 3 % 3 - 1, v[2] + k % 3 - 1);
    if (k > 13 && winner(v[0], v[1], v[2]) != i) source = -1;
    if (source < 0) continue;
    for (int64_t n = 0; n < c.inputs; ++n) {
      const double weight = c.w[static_cast<size_t>((channel * 27 + k) * c.inputs + n)];
      const double x = c.x[static_cast<size_t>(source * c.inputs + n)];
      sum += c.precision == WeightPrecision::kBFloat16 ? BFloat16(weight) * BFloat16(x) : weight * x;
    }
  }
  return sum;
}

TEST(SparseConvolution, MatchesReferenceWithDuplicateVoxels) {
  ForEachSimdTarget([] {
    for (WeightPrecision precision : {WeightPrecision::kFloat, WeightPrecision::kBFloat16}) {
      for (int64_t count : {1, 2, 14, 15, 60, 130}) {
        for (int64_t outputs : {16, 64, 40}) {
          Convolution c = RandomConvolution(count, 23, outputs, 4);
          c.precision = precision;
          const std::vector<float> out = Convolve(c);
          for (int64_t i = 0; i < count; ++i) {
            for (int64_t o = 0; o < outputs; ++o) {
              ASSERT_NEAR(out[static_cast<size_t>(i * outputs + o)], Reference(c, i, o), 5e-6) << i << ' ' << o;
            }
          }
        }
      }
    }
  });
}

TEST(SparseConvolution, MatchesReferenceAcrossTasks) {
  const Convolution c = RandomConvolution(1100, 16, 272, 9);
  const std::vector<float> out = Convolve(c);
  for (int64_t i = 0; i < c.count; i += 13) {
    for (int64_t o = 0; o < c.outputs; o += 7) {
      ASSERT_NEAR(out[static_cast<size_t>(i * c.outputs + o)], Reference(c, i, o), 5e-6) << i << ' ' << o;
    }
  }
}

TEST(SparseConvolution, NothingForNoPoints) { EXPECT_TRUE(Convolve(RandomConvolution(0, 8, 8, 4)).empty()); }

TEST(SparseConvolution, SameBitsForAnyNumberOfThreads) {
  for (WeightPrecision precision : {WeightPrecision::kFloat, WeightPrecision::kBFloat16}) {
    Convolution c = RandomConvolution(3000, 48, 160, 12);
    c.precision = precision;
    SetThreadCount(1);
    const std::vector<float> one = Convolve(c);
    for (int threads : {2, 5}) {
      SetThreadCount(threads);
      const std::vector<float> many = Convolve(c);
      EXPECT_EQ(0, std::memcmp(one.data(), many.data(), one.size() * sizeof(float))) << threads;
    }
  }
  SetThreadCount(0);
}

TEST(SparseConvolution, NanReachesItsNeighboursOnly) {
  ForEachSimdTarget([] {
    Convolution c = RandomConvolution(100, 16, 32, 6);
    c.x[50 * 16 + 2] = std::numeric_limits<float>::quiet_NaN();
    const std::vector<float> out = Convolve(c);
    for (int64_t i = 0; i < c.count; ++i) {
      bool reads = false;
      for (int k = 0; k < kNeighbours; ++k) reads |= c.neighbours[static_cast<size_t>(i * kNeighbours + k)] == 50;
      for (int64_t o = 0; o < 32; ++o) {
        ASSERT_EQ(std::isnan(out[static_cast<size_t>(i * 32 + o)]), reads) << i;
      }
    }
  });
}

}  // namespace
}  // namespace anchorsplat
