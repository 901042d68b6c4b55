#include "kernels/attention.h"

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

struct Problem {
  int64_t count = 0;
  int64_t channels = 0;
  int64_t heads = 0;
  int64_t patch_size = 0;
  float scale = 0;
  Rounding rounding = Rounding::kNone;
  std::vector<float> qkv = {};
  std::vector<int32_t> order = {};
  Buffer<int32_t> patch_rows = {};
};

Problem RandomProblem(uint64_t seed, int64_t count, int64_t channels, int64_t heads, int64_t patch_size,
                      double size = 1) {
  Random random(seed);
  Problem p{.count = count, .channels = channels, .heads = heads, .patch_size = patch_size};
  p.scale = static_cast<float>(1 / std::sqrt(static_cast<double>(channels) / static_cast<double>(heads)));
  p.qkv.resize(static_cast<size_t>(count * 3 * channels));
  for (float& x : p.qkv) x = static_cast<float>(size * random.Normal());
  for (int64_t i = 0; i < count; ++i) p.order.push_back(static_cast<int32_t>(i));
  for (int64_t i = count - 1; i > 0; --i)
    std::swap(p.order[static_cast<size_t>(i)], p.order[static_cast<size_t>(random.Below(i + 1))]);
  p.patch_rows = PatchRows(p.order, patch_size);
  return p;
}

std::vector<float> Attend(const Problem& p) {
  std::vector<float> out(static_cast<size_t>(p.count * p.channels), -77.0f);
  AttentionCpu({.count = p.count,
                .channels = p.channels,
                .heads = p.heads,
                .scale = p.scale,
                .qkv = p.qkv.data(),
                .patch_rows = p.patch_rows.data(),
                .patch_size = p.patch_size,
                .rounding = p.rounding,
                .out = out.data()});
  return out;
}

// Nearest value with `bits` explicit bits of mantissa and smallest exponent `lowest`, ties to even.
double RoundedTo(double x, int bits, int lowest, double largest) {
  if (x == 0 || !std::isfinite(x)) return x;
  const int exponent = std::max(std::ilogb(x), lowest);
  const double unit = std::ldexp(1.0, exponent - bits);
  const double y = std::nearbyint(x / unit) * unit;
  return std::abs(y) > largest ? std::copysign(std::numeric_limits<double>::infinity(), x) : y;
}

double Rounded(Rounding rounding, double x) {
  switch (rounding) {
    case Rounding::kHalf:
      return RoundedTo(x, 10, -14, 65504);
    case Rounding::kBFloat16:
      return RoundedTo(x, 7, -126, 3.4e38);
    case Rounding::kNone:
      break;
  }
  return x;
}

// One query at a time: the patch is the 1024 consecutive points of the order around it, the last patch reaches back.
std::vector<double> AttendReference(const Problem& p) {
  std::vector<double> out(static_cast<size_t>(p.count * p.channels));
  const int64_t width = p.channels / p.heads;
  for (int64_t position = 0; position < p.count; ++position) {
    std::vector<int64_t> keys;  // rows of points
    if (p.count <= p.patch_size) {
      keys.assign(p.order.begin(), p.order.end());
    } else {
      const int64_t begin = position / p.patch_size * p.patch_size;
      for (int64_t i = 0; i < p.patch_size; ++i) {
        const int64_t at = begin + i;
        keys.push_back(p.order[static_cast<size_t>(at < p.count ? at : at - p.patch_size)]);
      }
    }
    const int64_t row = p.order[static_cast<size_t>(position)];
    for (int64_t h = 0; h < p.heads; ++h) {
      const auto value = [&](int64_t point, int64_t part, int64_t c) {
        return Rounded(p.rounding, p.qkv[static_cast<size_t>((point * 3 + part) * p.channels + h * width + c)]);
      };
      std::vector<double> scores;
      for (int64_t key : keys) {
        double dot = 0;
        for (int64_t c = 0; c < width; ++c) dot += value(row, 0, c) * value(key, 1, c);
        scores.push_back(dot * p.scale);
      }
      const double largest = *std::max_element(scores.begin(), scores.end());
      double total = 0;
      for (double& s : scores) total += s = std::exp(s - largest);
      for (int64_t c = 0; c < width; ++c) {
        double sum = 0;
        for (size_t j = 0; j < keys.size(); ++j) sum += Rounded(p.rounding, scores[j]) * value(keys[j], 2, c);
        out[static_cast<size_t>(row * p.channels + h * width + c)] = Rounded(p.rounding, sum / total);
      }
    }
  }
  return out;
}

void ExpectNear(const std::vector<float>& actual, const std::vector<double>& expected, double tolerance) {
  ASSERT_EQ(actual.size(), expected.size());
  for (size_t i = 0; i < actual.size(); ++i) {
    ASSERT_NEAR(actual[i], expected[i], tolerance) << "element " << i;
  }
}

TEST(Attention, MatchesReferenceForEveryPatchRemainder) {
  ForEachSimdTarget([] {
    for (int64_t count : {1, 2, 31, 63, 64, 65, 96, 97, 128, 129, 150, 191, 192, 193, 211}) {
      const Problem p = RandomProblem(static_cast<uint64_t>(count), count, 48, 3, 64);
      ExpectNear(Attend(p), AttendReference(p), 2e-6);
    }
  });
}

TEST(Attention, MatchesReferenceForTheHeadsOfTheNetworkAndOddOnes) {
  ForEachSimdTarget([] {
    const int64_t shapes[][2] = {{32, 1}, {48, 2}, {64, 4}, {4, 4}, {35, 5}, {13, 1}, {30, 1}};
    for (const auto& [channels, heads] : shapes) {
      const Problem p = RandomProblem(static_cast<uint64_t>(channels), 150, channels, heads, 64);
      ExpectNear(Attend(p), AttendReference(p), 2e-6);
    }
  });
}

TEST(Attention, MatchesReferenceAtThePatchSizeOfTheNetwork) {
  for (int64_t count : {1024, 1337}) {
    const Problem p = RandomProblem(7, count, 16, 1, kPatchSize);
    ExpectNear(Attend(p), AttendReference(p), 2e-6);
  }
}

// Scores of thousands: no exponential may overflow, whichever way the kernel keeps them in range.
TEST(Attention, SurvivesHugeAndTinyScores) {
  ForEachSimdTarget([] {
    for (double size : {1e-20, 1e-3, 3.0, 5.0, 8.0, 30.0, 100.0}) {
      const Problem p = RandomProblem(11, 150, 32, 2, 64, size);
      ExpectNear(Attend(p), AttendReference(p), 1e-6 * size * std::max(10.0, size * size));
    }
  });
}

TEST(Attention, RoundsLikeFusedAttentionInHalfPrecision) {
  ForEachSimdTarget([] {
    for (Rounding rounding : {Rounding::kHalf, Rounding::kBFloat16}) {
      const double unit = rounding == Rounding::kHalf ? std::ldexp(1.0, -11) : std::ldexp(1.0, -8);
      for (double size : {1.0, 4.0}) {
        Problem p = RandomProblem(5, 150, 48, 3, 64, size);
        p.rounding = rounding;
        const std::vector<float> out = Attend(p);
        const std::vector<double> expected = AttendReference(p);
        Problem exact = p;
        exact.rounding = Rounding::kNone;
        const std::vector<double> unrounded = AttendReference(exact);
        double error = 0;
        double expected_error = 0;
        for (size_t i = 0; i < out.size(); ++i) {
          ASSERT_EQ(out[i], Rounded(rounding, out[i]));  // on the grid
          ASSERT_NEAR(out[i], expected[i], 2.1 * unit * std::max(std::abs(expected[i]), 0.25));
          error += std::abs(out[i] - unrounded[i]);
          expected_error += std::abs(expected[i] - unrounded[i]);
        }
        // Probabilities are rounded relative to another score than here: other errors, but no larger or smaller ones.
        EXPECT_NEAR(error / expected_error, 1, 0.1);
      }
    }
  });
}

// Probabilities and results rounded twice, each time relative to another score: they may differ by 2^-8 of the mean of
// |value| and of the result.
void ExpectNearInBFloat16(const std::vector<float>& actual, const std::vector<double>& expected, double size) {
  ASSERT_EQ(actual.size(), expected.size());
  for (size_t i = 0; i < actual.size(); ++i) {
    ASSERT_NEAR(actual[i], expected[i], 0x1p-7 * std::max(std::abs(expected[i]), size)) << "element " << i;
  }
}

TEST(Attention, BFloat16MatchesReferenceForEveryPatchRemainder) {
  ForEachSimdTarget([] {
    for (int64_t count : {1, 2, 3, 5, 6, 7, 31, 63, 64, 65, 97, 128, 129, 150, 191, 193}) {
      Problem p = RandomProblem(static_cast<uint64_t>(count), count, 48, 3, 64);
      p.rounding = Rounding::kBFloat16;
      ExpectNearInBFloat16(Attend(p), AttendReference(p), 1);
    }
    for (int64_t patch_size : {1, 5, 63, 127}) {  // the last key of a patch has no other to make a pair with
      Problem p = RandomProblem(static_cast<uint64_t>(patch_size), 200, 16, 1, patch_size);
      p.rounding = Rounding::kBFloat16;
      ExpectNearInBFloat16(Attend(p), AttendReference(p), 1);
    }
  });
}

TEST(Attention, BFloat16MatchesReferenceForTheHeadsOfTheNetworkAndOddOnes) {
  ForEachSimdTarget([] {
    const int64_t shapes[][2] = {{32, 1}, {48, 2}, {64, 4}, {4, 4}, {35, 5}, {13, 1}, {30, 1}, {17, 1}, {80, 1}};
    for (const auto& [channels, heads] : shapes) {
      Problem p = RandomProblem(static_cast<uint64_t>(channels), 150, channels, heads, 64);
      p.rounding = Rounding::kBFloat16;
      ExpectNearInBFloat16(Attend(p), AttendReference(p), 1);
    }
  });
}

TEST(Attention, BFloat16MatchesReferenceAtThePatchSizeOfTheNetwork) {
  Problem p = RandomProblem(7, 1337, 24, 1, kPatchSize);
  p.rounding = Rounding::kBFloat16;
  const std::vector<double> expected = AttendReference(p);
  ForEachSimdTarget([&] {
    const std::vector<float> out = Attend(p);
    ExpectNearInBFloat16(out, expected, 1);
    // Errors of many keys mostly cancel, and on average they must, or a sum is off as a whole.
    double bias = 0;
    double error = 0;
    double magnitude = 0;
    for (size_t i = 0; i < out.size(); ++i) {
      const double difference = out[i] - expected[i];
      bias += expected[i] > 0 ? difference : -difference;
      error += std::abs(difference);
      magnitude += std::abs(expected[i]);
    }
    EXPECT_NEAR(bias / magnitude, 0, 1e-4);
    EXPECT_LT(error / magnitude, 0x1p-8);
  });
}

TEST(Attention, BFloat16SurvivesHugeAndTinyScores) {
  ForEachSimdTarget([] {
    for (double size : {1e-30, 1e-20, 1e-3, 3.0, 5.0, 8.0, 30.0, 100.0, 1e4}) {
      Problem p = RandomProblem(11, 150, 32, 2, 64, size);
      p.rounding = Rounding::kBFloat16;
      ExpectNearInBFloat16(Attend(p), AttendReference(p), size);
    }
  });
}

// All scores of a query far below zero: keys that only fill a tile must not win.
TEST(Attention, BFloat16PaddingHasNoWeight) {
  ForEachSimdTarget([] {
    for (float direction : {1.0f, -1.0f}) {
      Problem p = RandomProblem(13, 45, 16, 1, 64);
      p.rounding = Rounding::kBFloat16;
      for (int64_t i = 0; i < p.count; ++i) {
        float* q = p.qkv.data() + i * 48;
        q[0] = 40;
        q[16] = direction * 40;  // of the key: scores of ±400 everywhere
      }
      ExpectNearInBFloat16(Attend(p), AttendReference(p), 1);
    }
  });
}

// Bits of all fp16 numbers and of what lies half-way between them.
TEST(Attention, ValuesAreRoundedToNearestEven) {
  ForEachSimdTarget([] {
    for (Rounding rounding : {Rounding::kHalf, Rounding::kBFloat16}) {
      Random random(1);
      std::vector<float> values = {0.0f,     -0.0f,    1.0f,     65504.0f, 65519.0f,     65520.0f,    -70000.0f,
                                   0x1p-24f, 0x1p-25f, 0x3p-26f, 0x1p-14f, 0x1.ffcp-15f, 0x1.ffep-15f};
      for (int i = 0; i < 300; ++i) {
        const double scale = std::ldexp(1.0, static_cast<int>(random.Below(40)) - 26);
        values.push_back(static_cast<float>(random.Uniform(-1, 1) * scale));                    // anything
        values.push_back(static_cast<float>(static_cast<double>(random.Below(4096)) * scale));  // ties
      }
      // A point alone attends to itself: its output is its value, rounded.
      for (float v : values) {
        const float qkv[3] = {0.0f, 0.0f, v};
        const int32_t row = 0;
        float out = -1;
        AttentionCpu({.count = 1,
                      .channels = 1,
                      .heads = 1,
                      .scale = 1,
                      .qkv = qkv,
                      .patch_rows = &row,
                      .rounding = rounding,
                      .out = &out});
        ASSERT_EQ(out, static_cast<float>(Rounded(rounding, v))) << v;
      }
    }
  });
}

TEST(Attention, SameBitsForAnyNumberOfThreads) {
  for (Rounding rounding : {Rounding::kNone, Rounding::kBFloat16}) {
    Problem p = RandomProblem(3, 2500, 64, 2, kPatchSize, 3.0);
    p.rounding = rounding;
    SetThreadCount(1);
    const std::vector<float> one = Attend(p);
    for (int threads : {2, 3, 16}) {
      SetThreadCount(threads);
      const std::vector<float> many = Attend(p);
      EXPECT_EQ(0, std::memcmp(one.data(), many.data(), one.size() * sizeof(float))) << threads;
    }
    SetThreadCount(0);
  }
}

TEST(Attention, WritesNothingForNoPoints) {
  std::vector<float> out(64, 7.0f);
  AttentionCpu(
      {.count = 0, .channels = 64, .heads = 2, .scale = 1, .qkv = nullptr, .patch_rows = nullptr, .out = out.data()});
  EXPECT_EQ(out, std::vector<float>(64, 7.0f));
}

TEST(Attention, NanAndInfinityStayInTheirPatchAndHead) {
  ForEachSimdTarget([] {
    for (float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
      for (int kind : {0, 1, 2, 3, 4, 5}) {
        const int part = kind % 3;
        Problem clean = RandomProblem(9, 192, 32, 2, 64);
        clean.rounding = kind < 3 ? Rounding::kNone : Rounding::kBFloat16;
        const std::vector<float> expected = Attend(clean);
        Problem p = clean;
        const int64_t victim = p.order[70];                                   // second patch
        p.qkv[static_cast<size_t>((victim * 3 + part) * 32 + 16 + 3)] = bad;  // second head
        const std::vector<float> out = Attend(p);
        for (int64_t position = 0; position < p.count; ++position) {
          const int64_t row = p.order[static_cast<size_t>(position)];
          for (int64_t c = 0; c < 32; ++c) {
            const auto at = static_cast<size_t>(row * 32 + c);
            const bool reached = position / 64 == 1 && c >= 16 && (part != 0 || row == victim);
            if (!reached) {
              // A victim in the same group may change what its probabilities are relative to.
              ASSERT_NEAR(out[at], expected[at], kind < 3 ? 1e-6 : 0x1p-7) << part << ' ' << position << ' ' << c;
            } else if (std::isnan(bad) && (part != 2 || c == 19)) {
              ASSERT_TRUE(std::isnan(out[at])) << part << ' ' << position << ' ' << c;
            }
          }
        }
      }
    }
  });
}

}  // namespace
}  // namespace anchorsplat
