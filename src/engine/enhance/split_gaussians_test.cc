#include "enhance/split_gaussians.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/parallel.h"
#include "core/rotation.h"
#include "formats/random_cloud_for_test.h"

namespace anchorsplat {
namespace {

TEST(SplitGaussians, CopiesLieWithinTheirOriginal) {
  constexpr size_t kCopies = 64, kOriginals = 300;
  const GaussianCloud one = RandomCloud(1, 1, 5);
  const GaussianCloud cloud = Subset(one, std::vector<int64_t>(kOriginals, 0)).value();
  const auto split = SplitGaussians(cloud, {.copies = kCopies, .spread = 0.7, .shrink = 0.8, .seed = 1});
  ASSERT_TRUE(split.ok()) << split.error().message;
  ASSERT_EQ(split->size(), static_cast<int64_t>(kCopies * kOriginals));
  // Along each axis of the original: mean 0, standard deviation 0.7 of its own.
  const auto r = RotationFromQuaternion<double>(one.quats[0], one.quats[1], one.quats[2], one.quats[3]);
  for (size_t axis = 0; axis < 3; ++axis) {
    double sum = 0, squares = 0;
    for (size_t k = 0; k < kCopies * kOriginals; ++k) {
      double along = 0;
      for (size_t a = 0; a < 3; ++a) along += r[3 * a + axis] * (double{split->means[3 * k + a]} - one.means[a]);
      along /= std::exp(double{one.log_scales[axis]});
      sum += along, squares += along * along;
    }
    const double n = kCopies * kOriginals;
    EXPECT_NEAR(sum / n, 0, 0.02);
    EXPECT_NEAR(std::sqrt(squares / n), 0.7, 0.02);
  }
  for (size_t k = 0; k < kCopies * kOriginals; k += 97) {
    for (size_t a = 0; a < 3; ++a) {
      EXPECT_NEAR(split->log_scales[3 * k + a], one.log_scales[a] - 0.8 * std::log(8.0), 1e-5);
    }
    EXPECT_EQ(split->opacity_logits[k], one.opacity_logits[0]);
    for (size_t j = 0; j < 12; ++j) EXPECT_EQ(split->sh[12 * k + j], one.sh[j]);
  }
}

TEST(SplitGaussians, OneCopyIsTheOriginal) {
  GaussianCloud cloud = RandomCloud(20, 2, 6);
  cloud.render_mode = RenderMode::kAntialiased;
  ExpectSameCloud(*SplitGaussians(cloud, {.copies = 1}), cloud);
  EXPECT_EQ(SplitGaussians(cloud, {.copies = 2})->render_mode, RenderMode::kAntialiased);
}

TEST(SplitGaussians, FollowsFromTheSeedAlone) {
  const GaussianCloud cloud = RandomCloud(20000, 0, 7);
  SetThreadCount(1);
  const GaussianCloud one = *SplitGaussians(cloud, {.copies = 3, .seed = 4});
  SetThreadCount(5);
  ExpectSameCloud(*SplitGaussians(cloud, {.copies = 3, .seed = 4}), one);
  SetThreadCount(0);
  EXPECT_FALSE(SameBits(SplitGaussians(cloud, {.copies = 3, .seed = 5})->means, one.means));
}

TEST(SplitGaussians, EveryGaussianHasItsOwnNumber) {
  const GaussianCloud cloud = RandomCloud(3, 1, 9);
  const std::vector<int> each = {2, 1, 4};
  const auto split = SplitGaussians(cloud, {.copies = 2, .each = each});
  ASSERT_TRUE(split.ok()) << split.error().message;
  ASSERT_EQ(split->size(), 7);
  ExpectSameCloud(*Subset(*split, std::vector<int64_t>{2}), *Subset(cloud, std::vector<int64_t>{1}));
  EXPECT_NEAR(split->log_scales[0], cloud.log_scales[0] - 0.4 * std::log(2.0), 1e-5);
  EXPECT_NEAR(split->log_scales[9], cloud.log_scales[6] - 0.4 * std::log(4.0), 1e-5);
  EXPECT_EQ(split->opacity_logits[6], cloud.opacity_logits[2]);
  const std::vector<int> few = {2, 1}, none = {1, 0, 1};
  EXPECT_FALSE(SplitGaussians(cloud, {.copies = 2, .each = few}).ok());
  EXPECT_FALSE(SplitGaussians(cloud, {.copies = 2, .each = none}).ok());
}

TEST(CopiesByResidual, FollowItsRoot) {
  std::vector<double> residuals;
  for (int i = 0; i < 1000; ++i) residuals.push_back(i % 4 == 0 ? 9e-5 : 1e-5);
  const std::vector<int> each = CopiesByResidual(residuals, 8, 8 * std::ssize(residuals));
  int64_t sum = 0;
  for (const int copies : each) sum += copies;
  EXPECT_LE(sum, 8000);
  EXPECT_GT(sum, 7000);
  EXPECT_NEAR(each[0], 3.0 * each[1], 2);
  for (const auto& odd : {std::vector<double>{0, 0}, {NAN, 1}, {1e300, 1e-300}, {-1, 5}, {INFINITY, 1}}) {
    for (const int copies : CopiesByResidual(odd, 3, 3 * std::ssize(odd)))
      EXPECT_TRUE(copies >= 1 && copies <= 12) << odd[0];
  }
  EXPECT_TRUE(CopiesByResidual({}, 3, 0).empty());
}

TEST(SplitGaussians, Edges) {
  GaussianCloud cloud = RandomCloud(2, 0, 8);
  cloud.log_scales[0] = -INFINITY;  // a scale of zero
  cloud.quats = {0, 0, 0, 0, 1, 0, 0, 0};
  const auto split = SplitGaussians(cloud, {.copies = 2});
  ASSERT_TRUE(split.ok());
  EXPECT_EQ(split->means[0], cloud.means[0]);
  EXPECT_EQ(split->log_scales[0], -INFINITY);
  for (int64_t i = 0; i < 4; ++i) EXPECT_TRUE(IsUsable(*split, i));
  EXPECT_TRUE(SplitGaussians(GaussianCloud{}, {.copies = 2}).ok());
  EXPECT_FALSE(SplitGaussians(cloud, {.copies = 0}).ok());
  EXPECT_FALSE(SplitGaussians(cloud, {.copies = 2, .spread = -1}).ok());
}

}  // namespace
}  // namespace anchorsplat
