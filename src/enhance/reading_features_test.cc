#include "enhance/reading_features.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <set>

#include "core/run_context.h"

namespace anchorsplat {
namespace {

// A ball's surface of flat Gaussians of many sizes, with harmonics.
GaussianCloud Ball(int64_t count, double scale = 1) {
  std::mt19937 random(7);
  std::normal_distribution<float> normal;
  GaussianCloud cloud;
  cloud.Resize(count, 1);
  for (size_t i = 0; i < static_cast<size_t>(count); ++i) {
    float p[3];
    for (float& x : p) x = normal(random);
    const float length = std::hypot(p[0], p[1], p[2]);
    for (size_t c = 0; c < 3; ++c) {
      cloud.means[3 * i + c] = static_cast<float>(scale) * p[c] / length;
      cloud.log_scales[3 * i + c] = -4 + 0.7f * normal(random) + static_cast<float>(std::log(scale));
    }
    for (size_t c = 0; c < 4; ++c) cloud.quats[4 * i + c] = normal(random);
    cloud.opacity_logits[i] = 1 + 2 * normal(random);
    for (size_t c = 0; c < 12; ++c) cloud.sh[12 * i + c] = 0.3f * normal(random);
  }
  return cloud;
}

double ValueOf(const ReadingFeatures& features, const std::string& name) {
  for (size_t k = 0; k < features.names.size(); ++k) {
    if (features.names[k] == name) return features.values[k];
  }
  ADD_FAILURE() << name;
  return 0;
}

TEST(ReadingFeatures, AreTheSameOnesOfEverySplat) {
  const auto large = ReadFeatures(Ball(3000)), small = ReadFeatures(Ball(100));
  ASSERT_TRUE(large.ok() && small.ok());
  EXPECT_EQ(large->names, small->names);
  EXPECT_EQ(large->values.size(), large->names.size());
  EXPECT_EQ(std::set<std::string>(large->names.begin(), large->names.end()).size(), large->names.size());
  for (size_t k = 0; k < large->values.size(); ++k) {
    const bool unknown = large->names[k] == "twin.likeness_of_harmonics";  // of degree 2 and 3, which it has not
    EXPECT_EQ(std::isfinite(large->values[k]), !unknown) << large->names[k];
  }
  EXPECT_TRUE(std::isnan(ValueOf(*small, "twin.0")));  // too few to find any
}

TEST(ReadingFeatures, DoNotDependOnTheUnit) {
  const auto one = ReadFeatures(Ball(2000)), large = ReadFeatures(Ball(2000, 500));
  ASSERT_TRUE(one.ok() && large.ok());
  EXPECT_NEAR(large->unit / one->unit, 500, 0.1);
  for (size_t k = 0; k < one->values.size(); ++k) {
    if (std::isnan(one->values[k]) && std::isnan(large->values[k])) continue;
    EXPECT_NEAR(one->values[k], large->values[k], 0.02 + 0.01 * std::abs(one->values[k])) << one->names[k];
  }
}

TEST(ReadingFeatures, AreTheSameBitsForAnyNumberOfThreads) {
  const auto of = [](int threads) {
    const RunScope scope({.threads = threads});
    return ReadFeatures(Ball(2000));
  };
  const auto one = of(1), three = of(3);
  ASSERT_TRUE(one.ok() && three.ok());
  for (size_t k = 0; k < one->values.size(); ++k) {
    EXPECT_EQ(std::bit_cast<uint64_t>(one->values[k]), std::bit_cast<uint64_t>(three->values[k])) << one->names[k];
  }
}

TEST(ReadingFeatures, SeeWhatWasSetToOneValue) {
  GaussianCloud cloud = Ball(2000);
  EXPECT_LT(ValueOf(*ReadFeatures(cloud), "axis.same_smallest"), 0.02);
  for (size_t i = 0; i < cloud.log_scales.size(); i += 3) cloud.log_scales[i] = -9;
  EXPECT_GT(ValueOf(*ReadFeatures(cloud), "axis.same_smallest"), 0.9);
}

TEST(ReadingFeatures, SayWhatTheFileSays) {
  GaussianCloud cloud = Ball(500);
  EXPECT_EQ(ValueOf(*ReadFeatures(cloud), "file.antialiased"), 0);
  cloud.render_mode = RenderMode::kAntialiased;
  cloud.comments = {"enhanced by anchorsplat: model 4x"};
  const auto features = ReadFeatures(cloud);
  EXPECT_EQ(ValueOf(*features, "file.antialiased"), 1);
  EXPECT_EQ(ValueOf(*features, "file.classic"), 0);
  EXPECT_EQ(ValueOf(*features, "file.enhanced"), 1);
}

TEST(ReadingFeatures, OfBrokenRowsAreThoseOfTheOthers) {
  GaussianCloud cloud = Ball(1500);
  GaussianCloud broken = Ball(1500);
  GaussianCloud bad = Ball(40);
  for (size_t i = 0; i < 40; ++i) {
    bad.means[3 * i] = i % 2 == 0 ? std::numeric_limits<float>::quiet_NaN() : std::numeric_limits<float>::infinity();
  }
  ASSERT_TRUE(Append(broken, bad).ok());
  const auto of_all = ReadFeatures(broken), of_good = ReadFeatures(cloud);
  ASSERT_TRUE(of_all.ok() && of_good.ok());
  for (const char* name : {"alpha[0].3", "thin[2].7", "tail.middle", "surface.spacing", "closer[4].classic3"}) {
    EXPECT_NEAR(ValueOf(*of_all, name), ValueOf(*of_good, name), 1e-6) << name;
  }
}

TEST(ReadingFeatures, OfTooFewAreRefused) {
  EXPECT_EQ(ReadFeatures(Ball(5)).error().code, ErrorCode::kBadArgument);
  EXPECT_FALSE(ReadFeatures(GaussianCloud()).ok());
  GaussianCloud zero_turns = Ball(300);
  std::fill(zero_turns.quats.begin(), zero_turns.quats.end(), 0.0f);
  EXPECT_TRUE(ReadFeatures(zero_turns).ok());
}

}  // namespace
}  // namespace anchorsplat
