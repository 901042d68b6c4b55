#include <gtest/gtest.h>

#include <string>

#include "formats/attribute_error.h"
#include "formats/cloud_io.h"

namespace anchorsplat {
namespace {

// Files of independent programs and of ours, against what splat-transform reads from them (testdata/splats/README.md).
TEST(Golden, ReadsWhatSplatTransformReads) {
  const std::string folder = ANCHORSPLAT_SOURCE_DIR "/testdata/splats/";
  for (const std::string name :
       {"splat-transform.compressed.ply", "splat-transform.sog", "splat-transform.spz", "gaussforge.splat",
        "gaussforge.ksplat", "gaussforge.spz", "anchorsplat.compressed.ply", "anchorsplat.sog", "anchorsplat.spz",
        "anchorsplat-3.spz", "anchorsplat.splat"}) {
    const auto ours = ReadCloud(folder + name);
    ASSERT_TRUE(ours.ok()) << ours.error().message;
    const auto theirs = ReadCloud(folder + name + ".decoded.ply");
    ASSERT_TRUE(theirs.ok()) << theirs.error().message;
    EXPECT_EQ(ours->sh_degree, theirs->sh_degree) << name;
    const auto error = CompareAttributes(*ours, *theirs);
    ASSERT_TRUE(error.ok()) << name << ": " << error.error().message;
    // Where a byte says opacity 1, theirs is an infinite logit in some formats.
    EXPECT_GE(error->compared, 30) << name;
    EXPECT_LT(error->means.max, 1e-5) << name;
    EXPECT_LT(error->log_scales.max, 1e-5) << name;
    // .splat: 128 stands for 0 in the viewer that made the format, 127.5 in splat-transform.
    EXPECT_LT(error->rotations.max, name.ends_with(".splat") ? 0.03 : 1e-3) << name;
    EXPECT_LT(error->opacities.max, 1e-5) << name;
    EXPECT_LT(error->colors.max, 1e-5) << name;
    EXPECT_LT(error->harmonics.max, 1e-5) << name;
  }
}

}  // namespace
}  // namespace anchorsplat
