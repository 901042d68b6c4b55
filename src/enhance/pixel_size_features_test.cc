#include "enhance/pixel_size_features.h"

#include <gtest/gtest.h>

#include "core/source_dir_for_test.h"
#include "formats/cloud_io.h"

namespace anchorsplat {
namespace {

PixelSizeProbe Probe() {
  return PixelSizeProbe::Make(ReadCloud(SourceDirForTest() / "examples/biplane/input.ply").value()).value();
}

TEST(PixelSizeProbe, LooksAreKnownEachByItself) {
  PixelSizeProbe together = Probe(), alone = Probe();
  const double size = together.start();
  const PixelSizeFeatures alpha = together.At(size, Look::kAlpha).value();
  const PixelSizeFeatures over_black = together.At(size, Look::kOverBlack).value();
  EXPECT_NE(alpha, over_black);
  EXPECT_EQ(alone.At(size, Look::kOverBlack).value(), over_black);
  EXPECT_EQ(alone.At(size, Look::kAlpha).value(), alpha);
}

}  // namespace
}  // namespace anchorsplat
