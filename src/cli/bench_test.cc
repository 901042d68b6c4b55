#include <algorithm>
#include <filesystem>

#include "cli/run_for_test.h"
#include "cli/small_scan_for_test.h"
#include "formats/cloud_io.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

using ::testing::HasSubstr;

// What is measured needs a quiet machine and is no test (docs/results/speed.md); that words are understood is.
TEST(BenchVerb, TakesAndRefusesWords) {
  const TestFolder folder;
  const std::string none = folder / "none.ply";
  ExpectRefused({"bench"}, ErrorCode::kBadArgument, {"needs a verb: render, fit, network, convert, io, pixel-size"});
  ExpectRefused({"bench", "render", none}, ErrorCode::kNotFound, {"none.ply"});
  ExpectRefused({"bench", "network", none}, ErrorCode::kNotFound, {"none.ply"});
  ExpectRefused({"bench", "convert", none}, ErrorCode::kNotFound, {"none.ply"});
  ExpectRefused({"bench", "network", none, "--precision", "fp64"}, ErrorCode::kBadArgument, {"--precision"});
  ExpectRefused({"bench", "render", none, "--repeats", "0"}, ErrorCode::kBadArgument, {"--repeats"});
  ExpectRefused({"bench", "fit", "--width", "10"}, ErrorCode::kBadArgument, {"--width"});
  ExpectRefused({"bench", "convert", "--gaussians", "999"}, ErrorCode::kBadArgument, {"--gaussians"});
  ExpectRefused({"bench", "io", "--sh-degree", "4"}, ErrorCode::kBadArgument, {"--sh-degree"});
  ExpectRefused({"bench", "pixel-size", none}, ErrorCode::kBadArgument, {"none.ply"});
}

TEST(BenchVerb, PixelSize) {
  const nlohmann::json json = ExpectJson({"bench", "pixel-size", Biplane(), "--features"});
  ASSERT_EQ(json["objects"].size(), 1u);
  EXPECT_GT(json["objects"][0]["samples"].size(), 0u);
  EXPECT_LT(json["error_median"], 0.5);
  EXPECT_THAT(ExpectDone({"bench", "pixel-size", Biplane()}).out, HasSubstr("% in the median"));
}

TEST(BenchVerb, Looks) {
  const TestFolder folder;
  const std::string scan = Biplane() / "input.ply";
  const nlohmann::json json = ExpectJson({"bench", "looks", scan, "--features"});
  ASSERT_EQ(json["splats"].size(), 1u);
  EXPECT_EQ(json["splats"][0]["looks"], "classic");
  EXPECT_EQ(json["splats"][0]["features"].size(), 35u);
  EXPECT_THAT(ExpectDone({"bench", "looks", scan}).out, HasSubstr("classic"));
  ExpectRefused({"bench", "looks", folder / "none.ply"}, ErrorCode::kNotFound, {"none.ply"});
}

TEST(BenchVerb, GoesOnAfterASplatThatShowsNothing) {
  const TestFolder folder;
  std::filesystem::create_directories(folder / "objects");
  std::filesystem::copy(Biplane(), folder / "objects/good", std::filesystem::copy_options::recursive);
  std::filesystem::copy(Biplane(), folder / "objects/faint", std::filesystem::copy_options::recursive);
  GaussianCloud faint = *ReadCloud(folder / "objects/faint/input.ply");
  std::fill(faint.opacity_logits.begin(), faint.opacity_logits.end(), -20.0f);
  std::filesystem::remove(folder / "objects/faint/input.ply");
  ASSERT_TRUE(WriteCloud(folder / "objects/faint/input.ply", faint).ok());
  const nlohmann::json json = ExpectJson({"bench", "pixel-size", folder / "objects"});
  ASSERT_EQ(json["objects"].size(), 1u);
  EXPECT_EQ(json["objects"][0]["object"], "good");
  ASSERT_EQ(json["without_estimate"].size(), 1u);
  EXPECT_EQ(json["without_estimate"][0]["object"], "faint");
  ExpectRefused({"bench", "pixel-size", folder / "objects/faint"}, ErrorCode::kBadFile, {"none of these splats"});
}

}  // namespace
}  // namespace anchorsplat
