#include "formats/axes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "core/rotation.h"
#include "core/spherical_harmonics.h"
#include "formats/random_cloud_for_test.h"

namespace anchorsplat {
namespace {

// All 48: three directions in any order, each one way or the other.
std::vector<std::string> AllNames() {
  std::vector<std::string> names;
  std::string order = "012";
  do {
    for (int ways = 0; ways < 8; ++ways) {
      std::string name;
      for (const char axis : order) name += ((ways >> (axis - '0') & 1) != 0 ? "LUB" : "RDF")[axis - '0'];
      names.push_back(name);
    }
  } while (std::ranges::next_permutation(order).found);
  return names;
}

TEST(Axes, Names) {
  const std::vector<std::string> names = AllNames();
  EXPECT_EQ(std::set(names.begin(), names.end()).size(), 48u);
  for (const std::string& name : names) EXPECT_EQ(NameOfAxes(AxesFromName(name).value()), name);
  EXPECT_EQ(AxesFromName("rub"), kRub);
  EXPECT_EQ(AxesFromName("luf"), kLuf);
  for (const char* name : {"", "ru", "rubx", "rlu", "ffd", "xyz"}) EXPECT_FALSE(AxesFromName(name)) << name;
}

// What is right lies along right afterwards, and so on.
TEST(Axes, DirectionsStayWhereTheyAre) {
  GaussianCloud cloud = RandomCloud(1, 0, 1);
  cloud.means = {1, 2, 3};  // right, down, front
  TurnAxes(cloud, TurnBetween(kRdf, *AxesFromName("RFU")));
  EXPECT_THAT(cloud.means, testing::ElementsAre(1, 3, -2));
  TurnAxes(cloud, TurnBetween(*AxesFromName("RFU"), *AxesFromName("BLU")));
  EXPECT_THAT(cloud.means, testing::ElementsAre(-3, -1, -2));
  for (const std::string& a : AllNames()) {
    for (const char* b : {"RDF", "RFU", "DBL"}) {
      const Axes from = *AxesFromName(a), to = *AxesFromName(b);
      EXPECT_TRUE(Concatenate(TurnBetween(from, to), TurnBetween(to, from)).changes_nothing());
      EXPECT_EQ(Concatenate(TurnBetween(from, kRub), TurnBetween(kRub, to)), TurnBetween(from, to));
    }
  }
}

// Against the definition: turn or mirror the world, and the covariance and the colour seen from any side go with it.
TEST(Axes, CovarianceAndColourFollowTheWorld) {
  for (const std::string& name : AllNames()) {
    const AxisTurn turn = TurnBetween(kRdf, *AxesFromName(name));
    const std::array<double, 9> m = turn.matrix();
    const GaussianCloud before = RandomCloud(5, 3, 11);
    GaussianCloud after = before;
    TurnAxes(after, turn);
    const auto turned = [&m](const std::array<double, 3>& v) {
      std::array<double, 3> out{};
      for (size_t k = 0; k < 3; ++k) out[k] = m[3 * k] * v[0] + m[3 * k + 1] * v[1] + m[3 * k + 2] * v[2];
      return out;
    };
    for (size_t i = 0; i < 5; ++i) {
      const auto covariance = [i](const GaussianCloud& c) {
        const float* q = &c.quats[4 * i];
        const auto r = RotationFromQuaternion<double>(q[0], q[1], q[2], q[3]);
        std::array<double, 9> out{};
        for (size_t a = 0; a < 3; ++a) {
          for (size_t b = 0; b < 3; ++b) {
            for (size_t k = 0; k < 3; ++k) {
              out[3 * a + b] += r[3 * a + k] * std::exp(2.0 * c.log_scales[3 * i + k]) * r[3 * b + k];
            }
          }
        }
        return out;
      };
      const auto old_covariance = covariance(before), new_covariance = covariance(after);
      const auto mean = turned({before.means[3 * i], before.means[3 * i + 1], before.means[3 * i + 2]});
      for (size_t a = 0; a < 3; ++a) {
        EXPECT_EQ(after.means[3 * i + a], static_cast<float>(mean[a]));
        for (size_t b = 0; b < 3; ++b) {
          double expected = 0;
          for (size_t k = 0; k < 3; ++k) {
            for (size_t l = 0; l < 3; ++l) expected += m[3 * a + k] * old_covariance[3 * k + l] * m[3 * b + l];
          }
          EXPECT_NEAR(new_covariance[3 * a + b], expected, 1e-12 * (1 + std::abs(expected))) << name;
        }
      }
      Random random(i);
      std::array<double, 3> d = {random.Normal(), random.Normal(), random.Normal()};
      const double norm = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
      for (double& x : d) x /= norm;
      const auto color = [i](const GaussianCloud& c, const std::array<double, 3>& to) {
        const auto basis = ShBasis(to[0], to[1], to[2]);
        double sum = 0;
        for (size_t k = 0; k < 16; ++k) sum += basis[k] * c.sh[48 * i + 3 * k + 1];
        return sum;
      };
      EXPECT_NEAR(color(before, d), color(after, turned(d)), 1e-6) << name;
    }
    TurnAxes(after, TurnBetween(*AxesFromName(name), kRdf));
    EXPECT_TRUE(SameBits(after.means, before.means) && SameBits(after.quats, before.quats) &&
                SameBits(after.log_scales, before.log_scales))
        << name;
    for (size_t k = 0; k < before.sh.size(); ++k) ASSERT_NEAR(after.sh[k], before.sh[k], 2e-6) << name;
    EXPECT_TRUE(!turn.only_signs() || SameBits(after.sh, before.sh)) << name;
  }
}

TEST(Axes, LowerDegrees) {
  for (int degree = 0; degree < 3; ++degree) {
    GaussianCloud low = RandomCloud(5, degree, 2);
    GaussianCloud high = WithShDegree(low, 3);
    TurnAxes(low, TurnBetween(kRdf, kRub));
    TurnAxes(high, TurnBetween(kRdf, kRub));
    EXPECT_TRUE(SameBits(low.sh, WithShDegree(high, degree).sh));
  }
}

}  // namespace
}  // namespace anchorsplat
