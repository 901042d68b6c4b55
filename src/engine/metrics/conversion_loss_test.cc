#include "metrics/conversion_loss.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/random.h"

namespace anchorsplat {
namespace {

GaussianCloud Ball() {
  GaussianCloud cloud;
  cloud.Resize(500, 1);
  Random random(1);
  for (float& x : cloud.means) x = static_cast<float>(random.Normal());
  for (float& x : cloud.log_scales) x = -2;
  for (float& x : cloud.quats) x = static_cast<float>(random.Normal());
  for (float& x : cloud.opacity_logits) x = 1;
  for (float& x : cloud.sh) x = static_cast<float>(random.Normal());
  return cloud;
}

TEST(ConversionLoss, NothingForTheSameCloudInAnotherOrder) {
  const GaussianCloud cloud = Ball();
  EXPECT_TRUE(std::isinf(MeasureConversionLoss(cloud, cloud, 2)->mean_psnr));
  std::vector<int64_t> rows(500);
  for (int64_t i = 0; i < 500; ++i) rows[static_cast<size_t>(i)] = 499 - i;
  EXPECT_GT(MeasureConversionLoss(cloud, *Subset(cloud, rows), 2)->min_psnr, 90);
}

TEST(ConversionLoss, IsTheSameInAnyUnit) {
  const GaussianCloud cloud = Ball();
  GaussianCloud changed = cloud;
  for (float& x : changed.sh) x += 0.1f;
  const double expected = MeasureConversionLoss(cloud, changed, 2)->mean_psnr;
  for (const float unit : {1e-6f, 1e-3f, 1e4f}) {
    GaussianCloud a = cloud, b = changed;
    for (GaussianCloud* scaled : {&a, &b}) {
      for (float& x : scaled->means) x *= unit;
      for (float& x : scaled->log_scales) x += std::log(unit);
    }
    EXPECT_NEAR(MeasureConversionLoss(a, b, 2)->mean_psnr, expected, 0.01) << unit;
  }
}

TEST(ConversionLoss, GrowsWithTheChange) {
  const GaussianCloud cloud = Ball();
  double last = INFINITY;
  for (const float change : {0.01f, 0.1f, 0.5f}) {
    GaussianCloud changed = cloud;
    for (float& x : changed.sh) x += change;
    const auto loss = MeasureConversionLoss(cloud, changed, 3);
    ASSERT_TRUE(loss.ok()) << loss.error().message;
    EXPECT_EQ(loss->views, 3);
    EXPECT_LT(loss->mean_psnr, last - 6);
    EXPECT_LE(loss->min_psnr, loss->mean_psnr);
    last = loss->mean_psnr;
  }
  EXPECT_EQ(MeasureConversionLoss(cloud, cloud, 0).error().code, ErrorCode::kBadArgument);
}

}  // namespace
}  // namespace anchorsplat
