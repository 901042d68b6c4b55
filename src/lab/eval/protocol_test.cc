#include "eval/protocol.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace anchorsplat {
namespace {

using ::testing::ElementsAre;

TEST(Protocol, UpstreamDropsTheFirstAndTheLastFive) {
  const std::vector<size_t> views = UpstreamViews(146);
  ASSERT_EQ(views.size(), 140u);
  EXPECT_EQ(views.front(), 1u);
  EXPECT_EQ(views.back(), 140u);  // n − 6
  EXPECT_THAT(UpstreamViews(7), ElementsAre(1));
  EXPECT_THAT(UpstreamViews(6), ElementsAre(0, 1, 2, 3, 4, 5));  // six or fewer: all
  EXPECT_THAT(UpstreamViews(1), ElementsAre(0));
  EXPECT_TRUE(UpstreamViews(0).empty());
}

TEST(Protocol, HeldOutIsEveryEighth) {
  const std::vector<size_t> views = HeldOutViews(146);
  ASSERT_EQ(views.size(), 19u);
  EXPECT_EQ(views.front(), 0u);
  EXPECT_EQ(views.back(), 144u);
  EXPECT_THAT(HeldOutViews(8), ElementsAre(0));
  EXPECT_THAT(HeldOutViews(9), ElementsAre(0, 8));
}

TEST(Protocol, ThinningSpreads) {
  const std::vector<size_t> views = {0, 8, 16, 24, 32, 40};
  EXPECT_EQ(SubsampleEvenly(views, 0), views);
  EXPECT_EQ(SubsampleEvenly(views, 9), views);
  EXPECT_THAT(SubsampleEvenly(views, 3), ElementsAre(0, 16, 32));
  EXPECT_THAT(SubsampleEvenly(views, 4), ElementsAre(0, 8, 24, 32));
}

TEST(Protocol, TruncationKeepsPicturesAndDarkensRenders) {
  // The published evaluation truncates the truth too; that must change nothing.
  Image bytes(256, 1, 1);
  for (int i = 0; i < 256; ++i) bytes.at(0, 0, i) = static_cast<float>(i) / 255.0f;
  const Buffer<float> before = bytes.pixels;
  TruncateTo8Bits(bytes);
  EXPECT_EQ(bytes.pixels, before);

  Image render(5, 1, 1);
  render.pixels = {-0.5f, 0.0039f, 0.5f, 0.999f, 7.0f};
  Image exact = render;
  TreatRender(Protocol::kUpstream, render);
  EXPECT_THAT(render.pixels, ElementsAre(0.0f, 0.0f, 127 / 255.0f, 254 / 255.0f, 1.0f));
  TreatRender(Protocol::kHeldOut, exact);
  EXPECT_THAT(exact.pixels, ElementsAre(0.0f, 0.0039f, 0.5f, 0.999f, 1.0f));
}

TEST(Protocol, Names) {
  EXPECT_EQ(FindProtocol("upstream"), Protocol::kUpstream);
  EXPECT_EQ(FindProtocol("heldout"), Protocol::kHeldOut);
  EXPECT_EQ(FindProtocol("held-out"), std::nullopt);
}

}  // namespace
}  // namespace anchorsplat
