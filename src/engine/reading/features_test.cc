#include "reading/features.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/activations.h"
#include "core/parallel.h"
#include "core/random.h"

namespace anchorsplat {
namespace {

// Discs on a sphere, as fits have them.
GaussianCloud Sphere(int64_t count, float radius = 1, uint64_t seed = 1) {
  Random random(seed);
  GaussianCloud cloud;
  cloud.Resize(count, 1);
  const float side = radius * std::sqrt(4 * std::numbers::pi_v<float> / static_cast<float>(count));
  for (int64_t i = 0; i < count; ++i) {
    std::array<float, 3> at;
    float length = 0;
    for (float& x : at) {
      x = static_cast<float>(random.Normal());
      length += x * x;
    }
    length = std::sqrt(length);
    for (size_t a = 0; a < 3; ++a) cloud.means[static_cast<size_t>(3 * i) + a] = radius * at[a] / length;
    for (size_t a = 0; a < 3; ++a) {
      cloud.log_scales[static_cast<size_t>(3 * i) + a] =
          std::log(side * (a == 0 ? 0.2f : 0.8f)) + 0.4f * static_cast<float>(random.Normal());
    }
    for (size_t a = 0; a < 4; ++a) cloud.quats[static_cast<size_t>(4 * i) + a] = static_cast<float>(random.Normal());
    cloud.opacity_logits[static_cast<size_t>(i)] = static_cast<float>(1 + 2 * random.Normal());
    for (int64_t k = 0; k < cloud.sh_stride(); ++k) {
      cloud.sh[static_cast<size_t>(cloud.sh_stride() * i + k)] = 0.3f * static_cast<float>(random.Normal());
    }
  }
  return cloud;
}

void ExpectAlike(const SplatFeatures& a, const SplatFeatures& b, double tolerance) {
  ASSERT_EQ(a.values.size(), b.values.size());
  for (size_t k = 0; k < a.values.size(); ++k) {
    if (std::isnan(a.values[k])) {
      EXPECT_TRUE(std::isnan(b.values[k])) << FeatureNames()[k];
    } else {
      EXPECT_NEAR(a.values[k], b.values[k], tolerance) << FeatureNames()[k];
    }
  }
}

TEST(Features, HaveANameEach) {
  const auto features = FeaturesOf(Sphere(2000));
  ASSERT_TRUE(features.ok());
  EXPECT_EQ(features->values.size(), FeatureNames().size());
}

TEST(Features, DoNotDependOnTheUnit) {
  const GaussianCloud cloud = Sphere(2000);
  GaussianCloud scaled = cloud;
  constexpr float kScale = 1024;  // which floats do not round
  for (float& x : scaled.means) x *= kScale;
  for (float& x : scaled.log_scales) x += std::log(kScale);
  const auto one = FeaturesOf(cloud), other = FeaturesOf(scaled);
  ASSERT_TRUE(one.ok() && other.ok());
  EXPECT_NEAR(other->unit / one->unit, kScale, 1e-3 * kScale);
  ExpectAlike(*one, *other, 0.03);
}

TEST(Features, AreTheSameForAnyNumberOfThreads) {
  const GaussianCloud cloud = Sphere(3000);
  SetThreadCount(1);
  const auto one = FeaturesOf(cloud);
  SetThreadCount(3);
  const auto three = FeaturesOf(cloud);
  SetThreadCount(0);
  ASSERT_TRUE(one.ok() && three.ok());
  EXPECT_EQ(one->unit, three->unit);
  ExpectAlike(*one, *three, 0);
}

TEST(Features, OutlinesFallInUnitsOfTheSize) {
  const auto features = FeaturesOf(Sphere(4000));
  ASSERT_TRUE(features.ok());
  const auto at = [&](const std::string& name) {
    return features->values[static_cast<size_t>(std::ranges::find(FeatureNames(), name) - FeatureNames().begin())];
  };
  EXPECT_GT(at("outline[-3].classic6"), at("outline[3].classic6"));
}

TEST(Features, TheUnitIsThatOfMostPlacesNotOfMostOfTheArea) {
  const GaussianCloud subject = Sphere(8000);
  GaussianCloud walls = Sphere(1000, 3, 2);  // of 9000 Gaussians, with most of the area
  for (size_t k = 0; k < walls.means.size(); k += 3) walls.means[k] += 5;
  for (float& x : walls.log_scales) x = std::log(0.2f);
  for (float& logit : walls.opacity_logits) logit = 3;
  GaussianCloud both = subject;
  ASSERT_TRUE(Append(both, walls).ok());
  const auto alone = FeaturesOf(subject), with_walls = FeaturesOf(both);
  ASSERT_TRUE(alone.ok() && with_walls.ok());
  EXPECT_NEAR(with_walls->unit / alone->unit, 1, 0.1);
}

TEST(Features, NeedGaussiansThatShow) {
  GaussianCloud cloud = Sphere(200);
  for (float& logit : cloud.opacity_logits) logit = LogitFromOpacity(0.01f);
  EXPECT_EQ(FeaturesOf(cloud).error().code, ErrorCode::kBadArgument);
  EXPECT_FALSE(FeaturesOf(Sphere(10)).ok());
  EXPECT_FALSE(FeaturesOf(GaussianCloud()).ok());
}

TEST(Features, BearWhatFilesContain) {
  GaussianCloud cloud = Sphere(2000);
  cloud.means[0] = std::nanf("");
  cloud.log_scales[4] = INFINITY;
  cloud.log_scales[7] = -INFINITY;  // flat
  for (size_t k = 8; k < 12; ++k) cloud.quats[k] = 0;
  cloud.opacity_logits[5] = INFINITY;
  for (size_t a = 0; a < 3; ++a) cloud.means[300 + a] = 1e30f;
  const auto features = FeaturesOf(cloud);
  ASSERT_TRUE(features.ok()) << features.error().message;
  for (size_t k = 0; k < features->values.size(); ++k) {
    EXPECT_FALSE(std::isinf(features->values[k])) << FeatureNames()[k];
  }
  // All at one place, and all flat.
  GaussianCloud point = Sphere(500);
  std::ranges::fill(point.means, 0.5f);
  const auto at_one_place = FeaturesOf(point);
  ASSERT_TRUE(at_one_place.ok()) << at_one_place.error().message;
  for (size_t i = 0; i < point.log_scales.size(); i += 3) point.log_scales[i] = -INFINITY;
  const auto flat = FeaturesOf(point);
  ASSERT_TRUE(flat.ok()) << flat.error().message;
  EXPECT_EQ(flat->values.size(), FeatureNames().size());
}

}  // namespace
}  // namespace anchorsplat
