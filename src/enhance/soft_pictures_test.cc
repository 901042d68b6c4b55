#include "enhance/soft_pictures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "core/random.h"
#include "core/source_dir_for_test.h"
#include "enhance/enhance.h"
#include "formats/cloud_io.h"

namespace anchorsplat {
namespace {

// Of a fit, each Gaussian twice and half as opaque, moved by `blur` of a pixel, and none thinner than a third of one
// along two axes, as soft pictures leave them.
GaussianCloud Softened(double blur) {
  constexpr double kPixel = 0.0055;
  GaussianCloud cloud = ReadCloud(SourceDirForTest() / "examples" / "biplane" / "input.ply").value();
  std::vector<int64_t> rows(static_cast<size_t>(2 * cloud.size()));
  std::iota(rows.begin(), rows.end(), 0);
  for (int64_t& row : rows) row /= 2;
  cloud = Subset(cloud, rows).value();
  cloud.render_mode.reset();
  Random random(1);
  const auto least = static_cast<float>(std::log(0.32 * kPixel));
  for (size_t i = 0; i < rows.size(); ++i) {
    cloud.opacity_logits[i] -= 0.7f;
    std::array<size_t, 3> axes = {3 * i, 3 * i + 1, 3 * i + 2};
    std::ranges::sort(axes, {}, [&](size_t k) { return cloud.log_scales[k]; });
    for (const size_t k : axes) {
      cloud.means[k] += static_cast<float>(blur * kPixel * random.Normal());
      if (k != axes[0]) cloud.log_scales[k] = std::max(cloud.log_scales[k], least);
    }
  }
  return cloud;
}

std::optional<TrainedKind> KindOf(const GaussianCloud& cloud, std::optional<RenderMode> tag = {}) {
  const ShowingGaussians showing = FindShowingGaussians(cloud);
  return BesideSoftness(TrainedKindOf(cloud, showing), tag, showing);
}

TEST(SoftPictures, AreNotTakenForAntialiased) {
  const GaussianCloud sharp = Softened(0), soft = Softened(1.5);
  const ShowingGaussians showing = FindShowingGaussians(soft);
  ASSERT_EQ(TrainedKindOf(soft, showing), TrainedKind::kAntialiased);
  EXPECT_EQ(KindOf(soft), TrainedKind::kClassic);
  EXPECT_EQ(KindOf(soft, RenderMode::kAntialiased), TrainedKind::kAntialiased) << "a tag is believed";
  EXPECT_EQ(KindOf(sharp), TrainedKind::kAntialiased);
  EXPECT_EQ(BesideSoftness(TrainedKind::kUnclear, {}, showing), TrainedKind::kClassic);
  EXPECT_EQ(BesideSoftness(TrainedKind::kUnclear, RenderMode::kClassic, showing), TrainedKind::kUnclear);
  EXPECT_EQ(BesideSoftness(TrainedKind::kEnhanced, {}, showing), TrainedKind::kEnhanced);
  GaussianCloud wide = soft;  // a width in all axes
  for (float& scale : wide.log_scales) scale = std::max(scale, std::log(0.0014f));
  EXPECT_EQ(BesideSoftness(TrainedKind::kUnclear, {}, FindShowingGaussians(wide)), TrainedKind::kUnclear);
  // As in an antialiased hedge: opaque ones among the thinnest, or a shorter tail.
  GaussianCloud hedge = soft, even = soft;
  for (float& logit : hedge.opacity_logits) logit = 5;
  EXPECT_EQ(BesideSoftness(TrainedKind::kAntialiased, {}, FindShowingGaussians(hedge)), TrainedKind::kAntialiased);
  EXPECT_EQ(BesideSoftness(TrainedKind::kAntialiased, {}, showing), TrainedKind::kClassic);
  for (float& scale : even.log_scales) scale = std::max(scale, std::log(0.0022f));
  EXPECT_EQ(BesideSoftness(TrainedKind::kAntialiased, {}, FindShowingGaussians(even)), TrainedKind::kAntialiased);
  EXPECT_EQ(BesideSoftness(std::nullopt, {}, showing), std::nullopt);
  EXPECT_EQ(BesideSoftness(TrainedKind::kAntialiased, {}, ShowingGaussians()), TrainedKind::kAntialiased);

  const auto enhanced = Enhance(soft, {});
  ASSERT_TRUE(enhanced.ok()) << enhanced.error().message;
  EXPECT_EQ(enhanced->report.looks, TrainedKind::kClassic);
  EXPECT_FALSE(enhanced->cloud.render_mode);
  EXPECT_LT(enhanced->report.finding->estimate.softness, 0.75);
}

}  // namespace
}  // namespace anchorsplat
