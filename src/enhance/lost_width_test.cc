#include "enhance/lost_width.h"

#include <gtest/gtest.h>

#include "enhance/enhanced_mark.h"
#include "enhance/filter.h"

namespace anchorsplat {
namespace {

constexpr double kUpscale = 4;

GaussianCloud Tagged(std::optional<RenderMode> mode) {
  GaussianCloud cloud;
  cloud.render_mode = mode;
  return cloud;
}

TEST(LostWidth, IsWhatTheTagSays) {
  for (const RenderMode mode : {RenderMode::kClassic, RenderMode::kAntialiased, RenderMode::kMip}) {
    const LostWidth lost = FindLostWidth(Tagged(mode), TrainedKind::kClassic, kUpscale);
    EXPECT_EQ(lost.strength, DefaultFilterStrength(kUpscale, mode));
    EXPECT_EQ(lost.reason, LostWidthReason::kTagged);
    EXPECT_TRUE(lost.likely());
  }
}

TEST(LostWidth, IsThatOfItsKindWithoutATag) {
  const LostWidth classic = FindLostWidth(Tagged({}), TrainedKind::kClassic, kUpscale);
  const LostWidth antialiased = FindLostWidth(Tagged({}), TrainedKind::kAntialiased, kUpscale);
  EXPECT_EQ(classic.strength, DefaultFilterStrength(kUpscale));
  EXPECT_EQ(antialiased.strength, DefaultFilterStrength(kUpscale, RenderMode::kAntialiased));
  EXPECT_TRUE(classic.likely() && antialiased.likely());
  // Cautious where it is not known.
  const LostWidth unclear = FindLostWidth(Tagged({}), TrainedKind::kUnclear, kUpscale);
  EXPECT_EQ(unclear.strength, antialiased.strength);
  EXPECT_FALSE(unclear.likely());
  for (const auto tag : {std::optional<RenderMode>(), std::optional(RenderMode::kClassic)}) {
    const LostWidth raised = FindLostWidth(Tagged(tag), TrainedKind::kRaised, kUpscale);
    EXPECT_EQ(raised.strength, antialiased.strength);
    EXPECT_EQ(raised.reason, LostWidthReason::kRaised);
    EXPECT_FALSE(raised.likely());
  }
  const LostWidth few = FindLostWidth(Tagged({}), {}, kUpscale);
  EXPECT_EQ(few.strength, antialiased.strength);
  EXPECT_FALSE(few.likely());
  GaussianCloud faint = Tagged({});  // many of which few show
  faint.Resize(kFewGaussians, 0);
  EXPECT_EQ(FindLostWidth(faint, {}, kUpscale).strength, classic.strength);
}

TEST(LostWidth, IsNoneWhereItHasBeenGivenBack) {
  EXPECT_EQ(FindLostWidth(Tagged({}), TrainedKind::kWidened, kUpscale).strength, 0);
  const LostWidth tagged = FindLostWidth(Tagged(RenderMode::kAntialiased), TrainedKind::kWidened, kUpscale);
  EXPECT_EQ(tagged.strength, 0);
  EXPECT_EQ(tagged.reason, LostWidthReason::kWidenedButTagged);
  EXPECT_EQ(FindLostWidth(Tagged({}), TrainedKind::kEnhanced, kUpscale).strength, 0);
  EXPECT_EQ(FindLostWidth(Tagged({}), TrainedKind::kEnhanced, kUpscale).reason, LostWidthReason::kLooksEnhanced);
  const LostWidth twins = FindLostWidth(Tagged(RenderMode::kAntialiased), TrainedKind::kEnhanced, kUpscale);
  EXPECT_EQ(twins.strength, 0);
  EXPECT_EQ(twins.reason, LostWidthReason::kEnhancedButTagged);
  EXPECT_GT(FindLostWidth(Tagged(RenderMode::kMip), TrainedKind::kEnhanced, kUpscale).strength, 0);
  // Trainers that know no other mode tag everything classic.
  EXPECT_EQ(FindLostWidth(Tagged(RenderMode::kClassic), TrainedKind::kWidened, kUpscale).reason,
            LostWidthReason::kWidenedButTagged);
  EXPECT_EQ(FindLostWidth(Tagged(RenderMode::kClassic), TrainedKind::kEnhanced, kUpscale).strength, 0);
  GaussianCloud enhanced = Tagged(RenderMode::kClassic);
  enhanced.comments = {EnhancedComment("filter", kUpscale)};
  EXPECT_EQ(FindLostWidth(enhanced, TrainedKind::kClassic, kUpscale).strength, 0);
}

}  // namespace
}  // namespace anchorsplat
