#include "core/sh_rotation.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/random.h"
#include "core/rotation.h"
#include "core/spherical_harmonics.h"

namespace anchorsplat {
namespace {

double Value(const std::array<float, 48>& sh, int channel, double x, double y, double z) {
  const auto basis = ShBasis(x, y, z);
  double sum = 0;
  for (size_t k = 0; k < 16; ++k) sum += basis[k] * static_cast<double>(sh[3 * k + static_cast<size_t>(channel)]);
  return sum;
}

TEST(ShRotation, TheRotatedFunctionIsTheOldOneSeenFromTheOldDirection) {
  Random random(4);
  for (int trial = 0; trial < 20; ++trial) {
    auto m = RotationFromQuaternion(random.Normal(), random.Normal(), random.Normal(), random.Normal());
    if (trial % 2 == 1) {
      for (size_t k = 0; k < 3; ++k) m[k] = -m[k];  // a mirror as well
    }
    std::array<float, 48> sh{};
    for (float& c : sh) c = static_cast<float>(random.Normal());
    std::array<float, 48> rotated = sh;
    ShRotation(m).Apply(rotated.data(), 3);
    for (int probe = 0; probe < 10; ++probe) {
      double d[3] = {random.Normal(), random.Normal(), random.Normal()};
      const double norm = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
      for (double& x : d) x /= norm;
      const double back[3] = {m[0] * d[0] + m[3] * d[1] + m[6] * d[2], m[1] * d[0] + m[4] * d[1] + m[7] * d[2],
                              m[2] * d[0] + m[5] * d[1] + m[8] * d[2]};
      for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(Value(rotated, c, d[0], d[1], d[2]), Value(sh, c, back[0], back[1], back[2]), 5e-6);
      }
    }
  }
}

TEST(ShRotation, LowerDegreesTouchOnlyTheirOwnCoefficients) {
  std::array<float, 48> sh{};
  sh.fill(0.5f);
  const ShRotation quarter_turn({0, -1, 0, 1, 0, 0, 0, 0, 1});
  quarter_turn.Apply(sh.data(), 1);
  for (size_t k = 0; k < 3; ++k) EXPECT_EQ(sh[k], 0.5f);
  EXPECT_NE(sh[3], sh[9]);
  for (size_t k = 12; k < 48; ++k) EXPECT_EQ(sh[k], 0.5f);
}

}  // namespace
}  // namespace anchorsplat
