#include "compact/compact_start.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace anchorsplat {
namespace {

// Root mean square difference of the copies' alpha from the Gaussian's, over ±4 standard deviations in the plane of the
// two longest axes.
double Difference(int64_t copies, double spread, double opacity) {
  const CopyStart start(copies, spread);
  const auto shape = start.ShapeOf(std::log(opacity / (1 - opacity)));
  const double of_copy = 1 / (1 + std::exp(-shape.opacity_logit));
  double sum = 0;
  int count = 0;
  for (double x = -4; x <= 4; x += 0.125) {
    for (double y = -4; y <= 4; y += 0.125, ++count) {
      double transmittance = 1;
      for (int64_t k = 0; k < copies; ++k) {
        const double dx = (x - start.offset(k)[0]) / std::exp(shape.log_shorter[0]);
        const double dy = (y - start.offset(k)[1]) / std::exp(shape.log_shorter[1]);
        transmittance *= 1 - of_copy * std::exp(-0.5 * (dx * dx + dy * dy));
      }
      const double difference = 1 - transmittance - opacity * std::exp(-0.5 * (x * x + y * y));
      sum += difference * difference;
    }
  }
  return std::sqrt(sum / count);
}

TEST(CopyStart, CopiesLookLikeTheGaussian) {
  for (const int64_t copies : {2, 3, 4, 10, 20}) {
    for (const double spread : {0.0, 0.4}) {
      for (const double opacity : {0.1, 0.5, 0.9, 0.99}) {
        // The Gaussian's own is about 0.22·opacity; the least possible about 0.016 for opaque ones and 20 copies.
        EXPECT_LT(Difference(copies, spread, opacity), 0.022 * opacity * opacity + 0.0005)
            << copies << " copies, spread " << spread << ", opacity " << opacity;
      }
    }
  }
}

TEST(CopyStart, PatternsAreCentredAndRound) {
  for (int64_t copies = 2; copies <= 64; ++copies) {
    const CopyStart start(copies, 0.3);
    double mean[2] = {0, 0}, square[2] = {0, 0}, product = 0;
    for (int64_t k = 0; k < copies; ++k) {
      for (size_t a = 0; a < 2; ++a)
        mean[a] += start.offset(k)[a], square[a] += start.offset(k)[a] * start.offset(k)[a];
      product += start.offset(k)[0] * start.offset(k)[1];
    }
    EXPECT_NEAR(mean[0], 0, 1e-12);
    EXPECT_NEAR(mean[1], 0, 1e-12);
    EXPECT_NEAR(product, 0, 1e-12);
    EXPECT_NEAR(square[0] / static_cast<double>(copies), 0.09, 1e-12);
    EXPECT_NEAR(square[1] / static_cast<double>(copies), copies == 2 ? 0 : 0.09, 1e-12);
  }
}

TEST(CopyStart, OneCopyIsTheGaussianAndExtremesAreHarmless) {
  const auto same = CopyStart(1, 0.4).ShapeOf(1.25);
  EXPECT_EQ(same.opacity_logit, 1.25);
  EXPECT_EQ(same.log_shorter[0], 0);
  const CopyStart start(4, 0.4);
  EXPECT_EQ(start.ShapeOf(-std::numeric_limits<double>::infinity()).opacity_logit,
            -std::numeric_limits<double>::infinity());
  EXPECT_NEAR(start.ShapeOf(-30).opacity_logit, -30 - std::log(4 * 0.84), 1e-3);
  for (const double logit : {-1e30, -700.0, 40.0, 1e30}) EXPECT_FALSE(std::isnan(start.ShapeOf(logit).opacity_logit));
  EXPECT_TRUE(std::isfinite(CopyStart(4, 1).ShapeOf(5).log_shorter[0]));
}

}  // namespace
}  // namespace anchorsplat
