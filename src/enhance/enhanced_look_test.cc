#include "enhance/enhanced_look.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <numeric>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/activations.h"
#include "core/parallel.h"
#include "core/random.h"
#include "core/rotation.h"
#include "core/source_dir_for_test.h"
#include "core/statistics.h"
#include "enhance/showing_gaussians.h"
#include "enhance/trained_kind.h"
#include "formats/cloud_io.h"

namespace anchorsplat {
namespace {

// Gaussians of every shape and colour on a sheet, `copies` of each, which differ by `spread`.
GaussianCloud Sheet(int64_t n, int64_t copies, double spread, uint64_t seed = 7) {
  GaussianCloud cloud;
  cloud.Resize(n * copies, 0);
  Random random(seed);
  for (size_t i = 0; i < static_cast<size_t>(n); ++i) {
    std::vector<double> own;
    for (int k = 0; k < 14; ++k) own.push_back(random.Normal());
    own[0] = random.Uniform(-1, 1);
    own[1] = random.Uniform(-1, 1);
    own[2] *= 0.01;
    for (size_t c = 0; c < static_cast<size_t>(copies); ++c) {
      const size_t row = i * static_cast<size_t>(copies) + c;
      const auto value = [&](size_t k, double unit = 1) {
        return static_cast<float>(own[k] + (copies > 1 ? unit * spread * random.Normal() : 0));
      };
      for (size_t a = 0; a < 3; ++a) {
        cloud.means[3 * row + a] = value(a, 0.02);
        cloud.log_scales[3 * row + a] = 0.7f * value(3 + a) - 4;
        cloud.sh[3 * row + a] = value(6 + a);
      }
      for (size_t a = 0; a < 4; ++a) cloud.quats[4 * row + a] = value(9 + a);
      cloud.opacity_logits[row] = value(13) + 1;
    }
  }
  return cloud;
}

// Of lengths as `length` says of each Gaussian.
void SetQuaternionLengths(GaussianCloud& cloud, const std::function<double(size_t)>& length) {
  for (size_t i = 0; i < cloud.opacity_logits.size(); ++i) {
    const std::span<float> q(&cloud.quats[4 * i], 4);
    double squares = 0;
    for (const float x : q) squares += double{x} * double{x};
    const double factor = length(i) / std::sqrt(squares);
    for (float& x : q) x = static_cast<float>(x * factor);
  }
}

std::optional<EnhancedLook> LookAt(const GaussianCloud& cloud) { return FindEnhancedLook(cloud, SizeTailsOf(cloud)); }

EnhancedLook LookOf(const GaussianCloud& cloud) {
  const auto look = LookAt(cloud);
  EXPECT_TRUE(look.has_value());
  return look.value_or(EnhancedLook{});
}

void ExpectNear(const EnhancedLook& a, const EnhancedLook& b, double tolerance) {
  for (size_t k = 0; k < a.size(); ++k) EXPECT_NEAR(a[k], b[k], tolerance) << "feature " << k;
}

// ln Σ halved, from the definition.
std::vector<double> LogCovariance(const GaussianCloud& cloud, size_t i) {
  const float* q = &cloud.quats[4 * i];
  const auto r = RotationFromQuaternion<double>(q[0], q[1], q[2], q[3]);
  std::vector<double> out(9);
  for (size_t a = 0; a < 3; ++a) {
    for (size_t b = 0; b < 3; ++b) {
      for (size_t k = 0; k < 3; ++k)
        out[3 * a + b] += r[3 * a + k] * r[3 * b + k] * double{cloud.log_scales[3 * i + k]};
    }
  }
  return out;
}

// All pairs, in plain loops.
TEST(EnhancedLook, IsThatOfAPlainSearch) {
  const GaussianCloud cloud = Sheet(350, 3, 0.2);
  const auto n = static_cast<size_t>(cloud.size());
  std::vector<std::vector<float>> differences(3), others(3);
  for (size_t i = 0; i < n; ++i) {
    std::vector<std::pair<double, size_t>> nearest;
    for (size_t j = 0; j < n; ++j) {
      if (j != i) nearest.emplace_back(SquaredDistance(&cloud.means[3 * i], &cloud.means[3 * j]), j);
    }
    std::sort(nearest.begin(), nearest.end());
    nearest.resize(8);
    for (auto& [difference, j] : nearest) {
      const auto a = LogCovariance(cloud, i), b = LogCovariance(cloud, j);
      double sum = 0;
      for (size_t k = 0; k < 9; ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
      difference = std::sqrt(sum);
    }
    std::sort(nearest.begin(), nearest.end());
    for (size_t rank = 0; rank < 3; ++rank) differences[rank].push_back(static_cast<float>(nearest[rank].first));
    const size_t twin = nearest[0].second;
    const float* q = &cloud.quats[4 * i];
    const auto r = RotationFromQuaternion<double>(q[0], q[1], q[2], q[3]);
    double squares = 0, colour = 0;
    for (size_t a = 0; a < 3; ++a) {
      double along = 0;
      for (size_t k = 0; k < 3; ++k) along += r[3 * k + a] * double{cloud.means[3 * twin + k] - cloud.means[3 * i + k]};
      squares += std::pow(along / std::exp(double{cloud.log_scales[3 * i + a]}), 2);
      colour = std::max(colour, double{std::abs(cloud.sh[3 * twin + a] - cloud.sh[3 * i + a])});
    }
    others[0].push_back(static_cast<float>(std::sqrt(squares)));
    others[1].push_back(static_cast<float>(colour));
    others[2].push_back(std::abs(cloud.opacity_logits[twin] - cloud.opacity_logits[i]));
  }
  EnhancedLook expected = LookOf(cloud);
  size_t next = 0;
  for (auto& values : differences) {
    for (const double q : {0.1, 0.25, 0.5, 0.75, 0.9}) expected[next++] = std::log(double{Quantile(values, q)} + 0.02);
  }
  for (auto& values : others) {
    for (const double q : {0.25, 0.5, 0.75}) expected[next++] = std::log(double{Quantile(values, q)} + 0.02);
  }
  std::vector<float> opacities;
  for (const float logit : cloud.opacity_logits) opacities.push_back(Sigmoid(logit));
  expected[33] = double{Quantile(opacities, 0.5)};
  expected[34] = double{Quantile(opacities, 0.25)};
  ExpectNear(LookOf(cloud), expected, 1e-4);
}

TEST(EnhancedLook, TwinsAreAlikeWhereThereAreCopies) {
  const EnhancedLook copies = LookOf(Sheet(1000, 4, 0.1)), alone = LookOf(Sheet(4000, 1, 0));
  EXPECT_LT(copies[kTwinUpperQuartile], -1);
  EXPECT_GT(alone[kTwinUpperQuartile], 0);
  EXPECT_EQ(LogOddsOfEnhanced(alone), -std::numeric_limits<double>::infinity());
  EXPECT_TRUE(std::isfinite(LogOddsOfEnhanced(copies)));
}

// Clones of densification that few steps have moved lie on top of each other, and those that were not cloned are turned
// in all directions.
TEST(EnhancedLook, TwinsOfFewStepsAreUnrelated) {
  const auto are_unrelated = [](const GaussianCloud& cloud) {
    FoundTwins twins{.unrelated = true, .rows = {}};
    EXPECT_TRUE(FindEnhancedLook(cloud, SizeTailsOf(cloud), &twins).has_value());
    return twins.unrelated;
  };
  EXPECT_FALSE(are_unrelated(Sheet(2000, 3, 0.1)));
  GaussianCloud few = Sheet(4000, 1, 0);
  for (size_t i = 0; i < few.log_scales.size(); ++i) few.log_scales[i] = -3.5f - static_cast<float>(i % 3);
  for (size_t i = 0; i < 4000; i += 8) {  // every eighth has a clone
    std::copy_n(few.means.data() + 3 * i, 3, few.means.data() + 3 * i + 3);
    std::copy_n(few.quats.data() + 4 * i, 4, few.quats.data() + 4 * i + 4);
  }
  EXPECT_TRUE(are_unrelated(few));
  // Beside each other by half a standard deviation, as with one of each of a network, and by more, as after a split.
  for (const auto& [deviations, unrelated] : {std::pair(0.5f, false), std::pair(0.9f, true)}) {
    GaussianCloud beside = few;
    for (size_t i = 0; i < 4000; i += 8) {
      const float* q = few.quats.data() + 4 * i;
      const auto r = RotationFromQuaternion(double{q[0]}, double{q[1]}, double{q[2]}, double{q[3]});
      const float shift = deviations * std::exp(-3.5f);  // the largest axis is the first
      for (size_t a = 0; a < 3; ++a) beside.means[3 * i + 3 + a] += shift * static_cast<float>(r[3 * a]);
    }
    EXPECT_EQ(are_unrelated(beside), unrelated) << deviations;
  }
  GaussianCloud enhanced = few;  // as they would be if each were turned as its twin
  for (size_t i = 0; i < enhanced.quats.size(); ++i) enhanced.quats[i] = few.quats[i % 4];
  EXPECT_FALSE(are_unrelated(enhanced));
}

// A network multiplies the harmonics of a Gaussian, a fit gives each its own.
TEST(EnhancedLook, HarmonicsOfTwins) {
  const GaussianCloud bare = Sheet(1000, 3, 0.1);
  FoundTwins twins;
  ASSERT_TRUE(FindEnhancedLook(bare, SizeTailsOf(bare), &twins).has_value());
  ASSERT_FALSE(twins.rows.empty());
  // The whole has another Gaussian before each.
  std::vector<int64_t> rows;
  for (int64_t i = 0; i < bare.size(); ++i) rows.push_back(2 * i + 1);
  GaussianCloud whole;
  whole.Resize(2 * bare.size(), 3);
  const auto stride = static_cast<size_t>(whole.sh_stride());
  const auto give = [&](bool own) {
    Random random(3);
    std::vector<float> values(stride);
    for (size_t i = 0; i < rows.size(); ++i) {
      if (own || i % 3 == 0) std::ranges::generate(values, [&] { return static_cast<float>(0.1 * random.Normal()); });
      const auto times = static_cast<float>(random.Uniform(0.5, 1.5));
      for (size_t k = 0; k < stride; ++k) whole.sh[static_cast<size_t>(rows[i]) * stride + k] = times * values[k];
    }
  };
  give(false);
  ASSERT_TRUE(LikenessOfHarmonics(whole, rows, twins).has_value());
  EXPECT_GT(*LikenessOfHarmonics(whole, rows, twins), 0.999);
  give(true);
  ASSERT_TRUE(LikenessOfHarmonics(whole, rows, twins).has_value());
  EXPECT_LT(*LikenessOfHarmonics(whole, rows, twins), 0.3);
  GaussianCloud steps = whole;  // of a format
  for (float& value : steps.sh) value = std::round(64 * value) / 64;
  EXPECT_FALSE(LikenessOfHarmonics(steps, rows, twins).has_value());
  GaussianCloud none = whole;
  std::ranges::fill(none.sh, 0.0f);
  EXPECT_FALSE(LikenessOfHarmonics(none, rows, twins).has_value());
  std::ranges::fill(none.sh, std::numeric_limits<float>::infinity());
  EXPECT_FALSE(LikenessOfHarmonics(none, rows, twins).has_value());
  GaussianCloud low;
  low.Resize(whole.size(), 1);
  EXPECT_FALSE(LikenessOfHarmonics(low, rows, twins).has_value());
  EXPECT_FALSE(LikenessOfHarmonics(CloudView(), {}, twins).has_value());
}

// Where it is a close call, harmonics of their own say that twins are of a fit, and shared ones of a network.
TEST(EnhancedLook, OwnHarmonicsDecideCloseCalls) {
  GaussianCloud cloud;
  const auto is_close = [&](double spread) {
    cloud = Sheet(1000, 3, spread);
    // Turned less than they are apart, as related ones are.
    for (size_t i = 0; i < cloud.quats.size(); ++i) {
      cloud.quats[i] = std::lerp(cloud.quats[i / 12 * 12 + i % 4], cloud.quats[i], 0.5f);
    }
    SetQuaternionLengths(cloud, [](size_t) { return 1; });
    FoundTwins twins;
    const auto look = FindEnhancedLook(cloud, SizeTailsOf(cloud), &twins);
    const double odds = look && !twins.unrelated ? LogOddsOfEnhanced(*look) : 0;
    return odds > 0.1 && odds < 1.2;
  };
  double spread = 0.2;
  while (spread < 0.4 && !is_close(spread)) spread += 0.005;
  ASSERT_LT(spread, 0.4) << "no sheet is a close call";
  const auto kind_with = [&](bool own) {
    GaussianCloud whole = cloud;
    whole.sh_degree = 3;
    const auto stride = static_cast<size_t>(whole.sh_stride());
    whole.sh.assign(static_cast<size_t>(whole.size()) * stride, 0);
    Random random(3);
    std::vector<float> values(stride);
    for (size_t i = 0; i < static_cast<size_t>(whole.size()); ++i) {
      if (own || i % 3 == 0) std::ranges::generate(values, [&] { return static_cast<float>(0.1 * random.Normal()); });
      std::ranges::copy(values, whole.sh.begin() + static_cast<std::ptrdiff_t>(i * stride));
      std::copy_n(cloud.sh.begin() + static_cast<std::ptrdiff_t>(3 * i), 3,
                  whole.sh.begin() + static_cast<std::ptrdiff_t>(i * stride));
    }
    return TrainedKindOf(whole, FindShowingGaussians(whole));
  };
  EXPECT_EQ(kind_with(false), TrainedKind::kEnhanced);
  EXPECT_NE(kind_with(true), TrainedKind::kEnhanced);
  // What shares them and still has the quaternions of a training is a fit's, too.
  Random random(5);
  SetQuaternionLengths(cloud, [&](size_t) { return random.Uniform(0.5, 1.5); });
  EXPECT_NE(kind_with(false), TrainedKind::kEnhanced);
}

TEST(EnhancedLook, QuaternionsOfTrainingHaveAnyLength) {
  GaussianCloud cloud = Sheet(1000, 1, 0);
  EXPECT_TRUE(HasQuaternionsOfTraining(cloud));
  SetQuaternionLengths(cloud, [](size_t) { return 1; });
  EXPECT_FALSE(HasQuaternionsOfTraining(cloud));
  SetQuaternionLengths(cloud, [](size_t i) { return i % 2 == 0 ? 0.992 : 1.008; });  // as .splat rounds
  EXPECT_FALSE(HasQuaternionsOfTraining(cloud));
  SetQuaternionLengths(cloud, [](size_t i) { return i < 500 ? 1 : 1.2; });  // half of them are a network's
  EXPECT_FALSE(HasQuaternionsOfTraining(cloud));
  SetQuaternionLengths(cloud, [](size_t i) { return i < 499 ? 1 : 1.02; });
  EXPECT_TRUE(HasQuaternionsOfTraining(cloud));
  EXPECT_FALSE(HasQuaternionsOfTraining({}));
  std::ranges::fill(cloud.quats, std::nanf(""));
  EXPECT_FALSE(HasQuaternionsOfTraining(cloud));
  for (const char* object : {"biplane", "stone_lantern", "tankard"}) {
    const auto fit = ReadCloud(SourceDirForTest() / "examples" / object / "input.ply");
    ASSERT_TRUE(fit.ok());
    EXPECT_TRUE(HasQuaternionsOfTraining(*fit)) << object;
  }
}

// Nor on the unit, the order of the rows or the number of threads.
TEST(EnhancedLook, DoesNotDependOnHowTheSplatIsKept) {
  const GaussianCloud cloud = Sheet(400, 3, 0.2);  // fewer than the samples
  const EnhancedLook look = LookOf(cloud);
  GaussianCloud other = cloud;
  for (float& x : other.means) x *= 100;
  for (float& s : other.log_scales) s += std::log(100.0f);
  for (size_t i = 0; i < other.quats.size(); ++i) other.quats[i] *= -3;
  ExpectNear(LookOf(other), look, 1e-3);
  std::vector<int64_t> rows(static_cast<size_t>(cloud.size()));
  std::iota(rows.rbegin(), rows.rend(), 0);
  const auto reversed = Subset(cloud, rows);
  ASSERT_TRUE(reversed.ok());
  ExpectNear(LookOf(*reversed), look, 1e-6);
  const GaussianCloud many = Sheet(3000, 3, 0.2);
  SetThreadCount(1);
  const EnhancedLook alone = LookOf(many);
  SetThreadCount(3);
  EXPECT_EQ(LookOf(many), alone);
  SetThreadCount(0);
}

TEST(EnhancedLook, OddClouds) {
  EXPECT_FALSE(LookAt({}));
  EXPECT_FALSE(LookAt(Sheet(1, 1, 0)));
  EXPECT_FALSE(LookAt(Sheet(999, 1, 0)));
  GaussianCloud cloud = Sheet(1200, 1, 0);
  for (size_t i = 0; i < 50; ++i) cloud.log_scales[3 * i] = -std::numeric_limits<float>::infinity();
  std::fill_n(cloud.quats.begin(), 400, 0.0f);
  for (const double x : LookOf(cloud)) EXPECT_TRUE(std::isfinite(x));
  for (size_t i = 50; i < 350; ++i) cloud.log_scales[3 * i + 1] = std::nanf("");
  EXPECT_FALSE(LookAt(cloud)) << "850 are left";
  // All at one place, and all the same.
  GaussianCloud same = Sheet(1200, 1, 0);
  std::ranges::fill(same.means, 1.0f);
  for (const double x : LookOf(same)) EXPECT_TRUE(std::isfinite(x));
  std::ranges::fill(same.log_scales, -3.0f);
  std::ranges::fill(same.opacity_logits, std::numeric_limits<float>::infinity());
  const EnhancedLook look = LookOf(same);
  for (const double x : look) EXPECT_TRUE(std::isfinite(x));
  EXPECT_FALSE(std::isnan(LogOddsOfEnhanced(look)));
  // Balls are all alike.
  GaussianCloud balls = Sheet(300, 4, 0.1);
  for (size_t i = 0; i < balls.log_scales.size(); ++i) balls.log_scales[i] = balls.log_scales[i - i % 3];
  EXPECT_EQ(LogOddsOfEnhanced(LookOf(balls)), -std::numeric_limits<double>::infinity());
  // Huge and tiny.
  GaussianCloud extreme = Sheet(1200, 1, 0);
  for (size_t i = 0; i < extreme.log_scales.size(); ++i) extreme.log_scales[i] = i % 2 == 0 ? 80.0f : -80.0f;
  for (const double x : LookOf(extreme)) EXPECT_TRUE(std::isfinite(x));
}

TEST(EnhancedLook, FitsDoNotLookEnhanced) {
  for (const char* object : {"biplane", "stone_lantern", "tankard"}) {
    const auto cloud = ReadCloud(SourceDirForTest() / "examples" / object / "input.ply");
    ASSERT_TRUE(cloud.ok());
    const auto look = LookAt(FindShowingGaussians(*cloud).all);
    ASSERT_TRUE(look.has_value());
    EXPECT_LT(LogOddsOfEnhanced(*look), 0) << object;
  }
}

}  // namespace
}  // namespace anchorsplat
