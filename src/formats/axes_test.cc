#include "formats/axes.h"

#include <gtest/gtest.h>

#include "core/rotation.h"
#include "core/spherical_harmonics.h"
#include "formats/random_cloud_for_test.h"

namespace anchorsplat {
namespace {

constexpr const char* kNames[] = {"RDF", "LDF", "RUF", "LUF", "RDB", "LDB", "RUB", "LUB"};

TEST(Axes, Names) {
  for (const char* name : kNames) EXPECT_EQ(NameOfAxes(AxesFromName(name).value()), name);
  EXPECT_EQ(AxesFromName("rub"), kRub);
  EXPECT_EQ(AxesFromName("luf"), kLuf);
  for (const char* name : {"", "ru", "rubx", "urb", "xyz"}) EXPECT_FALSE(AxesFromName(name)) << name;
}

// Against the definition: mirror the world, and the covariance and the colour seen from any side go with it.
TEST(Axes, CovarianceAndColourFollowTheMirroredWorld) {
  for (const char* name : kNames) {
    const AxisFlip flip = FlipBetween(kRdf, *AxesFromName(name));
    const GaussianCloud before = RandomCloud(20, 3, 11);
    GaussianCloud after = before;
    FlipAxes(after, flip);
    for (size_t i = 0; i < 20; ++i) {
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
      for (size_t a = 0; a < 3; ++a) {
        EXPECT_EQ(after.means[3 * i + a], flip.mean[a] * before.means[3 * i + a]);
        for (size_t b = 0; b < 3; ++b) {
          const double expected = double{flip.mean[a] * flip.mean[b]} * old_covariance[3 * a + b];
          EXPECT_NEAR(new_covariance[3 * a + b], expected, 1e-5 * (1 + std::abs(expected))) << name;
        }
      }
      Random random(i);
      const std::array<double, 3> d = {random.Normal(), random.Normal(), random.Normal()};
      const double norm = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
      const auto color = [i](const GaussianCloud& c, double x, double y, double z) {
        const auto basis = ShBasis(x, y, z);
        double sum = 0;
        for (size_t k = 0; k < 16; ++k) sum += basis[k] * c.sh[48 * i + 3 * k + 1];
        return sum;
      };
      EXPECT_NEAR(color(before, d[0] / norm, d[1] / norm, d[2] / norm),
                  color(after, flip.mean[0] * d[0] / norm, flip.mean[1] * d[1] / norm, flip.mean[2] * d[2] / norm),
                  1e-6)
          << name;
    }
    FlipAxes(after, FlipBetween(*AxesFromName(name), kRdf));
    ExpectSameCloud(after, before);
  }
}

TEST(Axes, LowerDegrees) {
  for (int degree = 0; degree < 3; ++degree) {
    GaussianCloud low = RandomCloud(5, degree, 2);
    GaussianCloud high = WithShDegree(low, 3);
    FlipAxes(low, FlipBetween(kRdf, kRub));
    FlipAxes(high, FlipBetween(kRdf, kRub));
    EXPECT_TRUE(SameBits(low.sh, WithShDegree(high, degree).sh));
  }
}

}  // namespace
}  // namespace anchorsplat
