#include "core/rotation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "core/random.h"

namespace anchorsplat {
namespace {

constexpr std::array<double, 9> kIdentity = {1, 0, 0, 0, 1, 0, 0, 0, 1};

// Rodrigues' formula: R = I + sin θ [k]× + (1 − cos θ) [k]×².
std::array<double, 9> RotationAbout(const std::array<double, 3>& k, double angle) {
  const std::array<double, 9> cross = {0, -k[2], k[1], k[2], 0, -k[0], -k[1], k[0], 0};
  std::array<double, 9> r = kIdentity;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) {
      double square = 0;
      for (size_t m = 0; m < 3; ++m) square += cross[3 * i + m] * cross[3 * m + j];
      r[3 * i + j] += std::sin(angle) * cross[3 * i + j] + (1 - std::cos(angle)) * square;
    }
  }
  return r;
}

void ExpectNear(const std::array<double, 9>& a, const std::array<double, 9>& b) {
  for (size_t k = 0; k < 9; ++k) EXPECT_NEAR(a[k], b[k], 1e-12) << k;
}

TEST(Rotation, MatchesRodriguesForAnyNormAndBack) {
  Random random(1);
  for (int n = 0; n < 200; ++n) {
    std::array<double, 3> axis = {random.Normal(), random.Normal(), random.Normal()};
    const double norm = std::hypot(axis[0], axis[1], axis[2]);
    for (double& x : axis) x /= norm;
    // Half turns too: there w is zero, where naive conversions divide by it.
    const double angle = n % 4 == 0 ? std::numbers::pi : random.Uniform(-std::numbers::pi, std::numbers::pi);
    const double scale = std::exp(random.Uniform(-5, 5));
    const double w = std::cos(angle / 2), s = std::sin(angle / 2);
    const auto rotation =
        RotationFromQuaternion(scale * w, scale * s * axis[0], scale * s * axis[1], scale * s * axis[2]);
    ExpectNear(rotation, RotationAbout(axis, angle));
    const auto q = QuaternionFromRotation(rotation);
    EXPECT_GE(q[0], 0);
    EXPECT_NEAR(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3], 1, 1e-12);
    ExpectNear(RotationFromQuaternion(q[0], q[1], q[2], q[3]), rotation);
  }
}

TEST(Rotation, QuarterTurnAboutZTakesXToY) {
  const float h = std::sqrt(0.5f);
  const auto r = RotationFromQuaternion(h, 0.0f, 0.0f, h);
  EXPECT_NEAR(r[0], 0, 1e-6);
  EXPECT_NEAR(r[3], 1, 1e-6);
  EXPECT_NEAR(r[6], 0, 1e-6);
}

TEST(Rotation, WhatIsNoRotationBecomesTheIdentity) {
  EXPECT_EQ(RotationFromQuaternion(0.0, 0.0, 0.0, 0.0), kIdentity);
  EXPECT_EQ(RotationFromQuaternion(std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0, 1.0), kIdentity);
}

}  // namespace
}  // namespace anchorsplat
