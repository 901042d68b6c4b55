#include "enhance/enhance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/source_dir_for_test.h"
#include "core/splat_comments.h"
#include "core/text.h"
#include "enhance/enhance_for_test.h"
#include "enhance/filter.h"
#include "formats/cloud_io.h"

namespace anchorsplat {
namespace {

TEST_F(EnhanceTest, AutoWithoutANetworkIsTheFilter) {
  const GaussianCloud ball = Ball(0.01);
  EnhanceOptions options;
  options.mode = RenderMode::kClassic;
  options.pixel_size = 0.01;
  const auto enhanced = Enhance(ball, options);
  ASSERT_TRUE(enhanced.ok()) << enhanced.error().message;
  EXPECT_EQ(enhanced->report.method, "filter");
  EXPECT_EQ(enhanced->report.gaussians_in, 6000);
  EXPECT_EQ(enhanced->report.gaussians_out, 6000);
  EXPECT_EQ(enhanced->report.dropped, 0);
  EXPECT_DOUBLE_EQ(enhanced->report.filter_strength, DefaultFilterStrength(4));
  GaussianCloud expected = ball;
  ASSERT_TRUE(ApplyFilter(expected, std::vector<float>{0.01f}, {}).ok());
  EXPECT_EQ(enhanced->cloud.log_scales, expected.log_scales);
}

TEST_F(EnhanceTest, DropsBrokenRowsAndSaysSo) {
  GaussianCloud ball = Ball(0.01);
  ball.means[3] = std::nanf("");
  ball.sh[6] = std::numeric_limits<float>::infinity();
  EnhanceOptions options;
  options.mode = RenderMode::kClassic;
  options.pixel_size = 0.01;
  const auto enhanced = Enhance(ball, options);
  ASSERT_TRUE(enhanced.ok());
  EXPECT_EQ(enhanced->report.dropped, 2);
  EXPECT_EQ(enhanced->cloud.size(), 5998);
  EXPECT_TRUE(log_->Says("dropped 2 of 6,000")) << log_->text();
  for (float& x : ball.means) x = std::nanf("");
  EXPECT_FALSE(Enhance(ball, options).ok());
  EXPECT_FALSE(Enhance(GaussianCloud{}, options).ok());
}

TEST_F(EnhanceTest, KeepsWhatIsOpaqueOrFlat) {
  GaussianCloud ball = Ball(0.01);
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  ball.opacity_logits[0] = kInfinity;
  ball.opacity_logits[1] = -kInfinity;
  ball.log_scales[6] = -kInfinity;
  EnhanceOptions options;
  options.mode = RenderMode::kClassic;
  options.pixel_size = 0.01;
  options.method = "filter";
  const auto enhanced = Enhance(ball, options);
  ASSERT_TRUE(enhanced.ok());
  EXPECT_EQ(enhanced->report.dropped, 0);
  EXPECT_EQ(enhanced->cloud.opacity_logits[0], kInfinity);
  EXPECT_TRUE(std::isfinite(enhanced->cloud.log_scales[6])) << "a flat Gaussian gets a width";
}

// Their fits have lost less width, and get less back; those of Mip-Splatting next to nothing.
TEST_F(EnhanceTest, GivesAntialiasedSplatsLess) {
  for (const RenderMode mode : {RenderMode::kAntialiased, RenderMode::kMip}) {
    GaussianCloud ball = Ball(0.01);
    ball.render_mode = mode;
    const GaussianCloud before = ball;
    EnhanceOptions options;
    options.pixel_size = 0.01;
    options.mode = mode;  // a ball is no splat that a reading knows
    auto enhanced = Enhance(ball, options);
    ASSERT_TRUE(enhanced.ok());
    const double strength = enhanced->report.filter_strength;
    EXPECT_EQ(strength, DefaultFilterStrength(4, mode));
    EXPECT_LT(strength, DefaultFilterStrength(4) / 2);
    EXPECT_EQ(enhanced->cloud.render_mode, mode);
    ASSERT_TRUE(ApplyFilter(ball, std::vector<float>{0.01f}, {.strength = strength}).ok());
    EXPECT_EQ(enhanced->cloud.log_scales, ball.log_scales);
    const auto variance = [](const GaussianCloud& cloud) { return std::exp(2 * double{cloud.log_scales[0]}); };
    EXPECT_NEAR((variance(ball) - variance(before)) / (0.01 * 0.01), mode == RenderMode::kMip ? 0.0028 : 0.0169, 1e-4);
    // Seen no closer nothing changes, and what has been enhanced is left alone.
    options.upscale = 1;
    EXPECT_EQ(Enhance(ball, options)->cloud.log_scales, ball.log_scales);
    options.upscale = 4;
    EXPECT_EQ(Enhance(enhanced->cloud, options)->cloud.log_scales, ball.log_scales);
  }
}

// Whoever enhances once more by mistake would lose what the first time brought.
TEST_F(EnhanceTest, LeavesWhatItMadeAlone) {
  EnhanceOptions options;
  options.mode = RenderMode::kClassic;
  options.pixel_size = 0.01;
  int starts = 0;
  options.starting = [&starts] { ++starts; };
  auto once = Enhance(Ball(0.01), options);
  ASSERT_TRUE(once.ok());
  EXPECT_EQ(starts, 1);
  EXPECT_TRUE(IsMarkedEnhanced(once->cloud));
  EXPECT_FALSE(log_->Says("already enhanced"));
  const auto twice = Enhance(once->cloud, options);
  ASSERT_TRUE(twice.ok());
  EXPECT_EQ(twice->cloud.log_scales, once->cloud.log_scales);
  EXPECT_EQ(twice->cloud.comments, once->cloud.comments);
  EXPECT_EQ(twice->report.filter_strength, 0);
  EXPECT_EQ(starts, 1) << "no work on a splat that is left alone";
  EXPECT_TRUE(log_->Says("already enhanced")) << log_->text();
  options.filter_strength = 0.7;
  const auto forced = Enhance(once->cloud, options);
  ASSERT_TRUE(forced.ok());
  EXPECT_NE(forced->cloud.log_scales, once->cloud.log_scales);

  // Nothing was given, so nothing is said.
  options.filter_strength.reset();
  options.upscale = 1;
  EXPECT_FALSE(IsMarkedEnhanced(Enhance(Ball(0.01), options)->cloud));
}

TEST_F(EnhanceTest, PixelSizeFromCameras) {
  EnhanceOptions options;
  options.mode = RenderMode::kClassic;
  options.cameras = CamerasForPixel(0.0025);
  const auto enhanced = Enhance(Ball(0.01), options);
  ASSERT_TRUE(enhanced.ok()) << enhanced.error().message;
  EXPECT_EQ(enhanced->report.pixel_size_source, PixelSizeSource::kCameras);
  EXPECT_NEAR(enhanced->report.pixel_size, 0.0041, 0.0002);  // of the median view: they stand all around
  EXPECT_EQ(enhanced->report.camera_rule, "median");
  EXPECT_TRUE(log_->Says("--camera-rule median, as the cameras surround the subject")) << log_->text();
  options.camera_rule = CameraPixelRule::kSmallest;
  const auto smallest = Enhance(Ball(0.01), options);
  ASSERT_TRUE(smallest.ok()) << smallest.error().message;
  EXPECT_NEAR(smallest->report.pixel_size, 0.0027, 0.0002);
  EXPECT_EQ(smallest->report.camera_rule, "smallest");
  options.pixel_size = 0.01;
  EXPECT_FALSE(Enhance(Ball(0.01), options).ok());  // both
}

// Cameras and regions are in the world, wherever the means begin.
TEST_F(EnhanceTest, FromAnOriginIsTheSame) {
  const WorldOrigin origin = {500000, 4500000, 0}, back = {-500000, -4500000, 0};
  EnhanceOptions options;
  options.method = "filter";
  options.mode = RenderMode::kClassic;
  options.cameras = CamerasForPixel(0.01);
  options.region = Region{.low = {0.5, 0, 0}, .high = {}, .radius = 0.4};
  const auto at_zero = Enhance(Ball(0.01), options);
  ASSERT_TRUE(at_zero.ok()) << at_zero.error().message;
  ASSERT_GT(at_zero->report.region_in, 100);
  GaussianCloud far = Ball(0.01);
  far.origin = origin;
  far.double_means = true;
  options.cameras = RelativeToOrigin(*options.cameras, back);
  options.region = RelativeToOrigin(*options.region, back);
  const auto from_origin = Enhance(far, options);
  ASSERT_TRUE(from_origin.ok()) << from_origin.error().message;
  EXPECT_EQ(from_origin->cloud.origin, origin);
  EXPECT_TRUE(from_origin->cloud.double_means);
  EXPECT_EQ(from_origin->report.region_in, at_zero->report.region_in);
  EXPECT_EQ(from_origin->cloud.means, at_zero->cloud.means);
  for (size_t i = 0; i < at_zero->cloud.log_scales.size(); ++i) {
    EXPECT_NEAR(from_origin->cloud.log_scales[i], at_zero->cloud.log_scales[i], 1e-4);
  }
}

// Of a fit whose training pixel is 1.7 / 309.02.
TEST_F(EnhanceTest, WarnsWhenCamerasAreNotThoseOfTheSplat) {
  const GaussianCloud cloud = ReadCloud(SourceDirForTest() / "examples/biplane/input.ply").value();
  EnhanceOptions options;
  options.cameras = CamerasForPixel(0.05);
  const auto cautious = Enhance(cloud, options);
  ASSERT_TRUE(cautious.ok());
  EXPECT_TRUE(log_->Says("ignoring the cameras")) << log_->text();
  EXPECT_EQ(cautious->report.pixel_size_source, PixelSizeSource::kRead);
  EXPECT_LT(cautious->report.pixel_size, 0.01) << "as it looks, so that nothing is blurred";
  // Whoever says a strength, or the mode, means these cameras.
  options.filter_strength = 0.7;
  EXPECT_GT(Enhance(cloud, options)->report.pixel_size, 0.04);
  options.filter_strength.reset();
  options.mode = RenderMode::kClassic;
  EXPECT_GT(Enhance(cloud, options)->report.pixel_size, 0.04);
  options.mode.reset();
}

TEST_F(EnhanceTest, FindsTheWidthInTrainingOfLargerPictures) {
  const GaussianCloud cloud = ReadCloud(SourceDirForTest() / "examples/biplane/input.ply").value();
  constexpr double kTrue = 1.7 / 309.02;
  EnhanceOptions options;
  options.cameras = CamerasForPixel(kTrue);
  const auto exact = Enhance(cloud, options);
  ASSERT_TRUE(exact.ok());
  EXPECT_FALSE(exact->report.train_width);
  EXPECT_FALSE(log_->Says("fitted to")) << log_->text();
  const int width = options.cameras->cameras[0].intrinsics.width;
  for (Camera& camera : options.cameras->cameras) camera.intrinsics = Scaled(camera.intrinsics, 4);
  const auto larger = Enhance(cloud, options);
  ASSERT_TRUE(larger.ok());
  EXPECT_EQ(larger->report.train_width, width);
  EXPECT_NEAR(larger->report.pixel_size, exact->report.pixel_size, 1e-6);
  EXPECT_TRUE(log_->Says(Cat("cameras at ", width, " pixels wide, not ", 4 * width))) << log_->text();
  // Whoever passes a width, or the mode, is believed.
  options.train_width = 4 * width;
  EXPECT_NEAR(Enhance(cloud, options)->report.pixel_size, exact->report.pixel_size / 4, 1e-6);
  options.train_width.reset();
  options.mode = RenderMode::kClassic;
  EXPECT_NEAR(Enhance(cloud, options)->report.pixel_size, exact->report.pixel_size / 4, 1e-6);
}

// Refinement renders what the splat showed at the size used in training, not at the cameras' larger one.
TEST_F(EnhanceTest, RefinesAtTheWidthInTraining) {
  EnhanceOptions options;
  options.method = "refine";
  options.mode = RenderMode::kClassic;
  options.refine.steps = 5;
  options.cameras = CamerasForPixel(0.01);
  const auto exact = Enhance(Ball(0.01), options);
  ASSERT_TRUE(exact.ok()) << exact.error().message;
  options.train_width = options.cameras->cameras[0].intrinsics.width;
  for (Camera& camera : options.cameras->cameras) camera.intrinsics = Scaled(camera.intrinsics, 2);
  const auto larger = Enhance(Ball(0.01), options);
  ASSERT_TRUE(larger.ok()) << larger.error().message;
  EXPECT_EQ(larger->cloud.log_scales, exact->cloud.log_scales);
}

TEST_F(EnhanceTest, SaysWhichTrainingWidthItAssumes) {
  EnhanceOptions options;
  options.mode = RenderMode::kClassic;
  options.cameras = CamerasForPixel(0.01);
  options.cameras->source = CameraSource::kColmap;
  for (Camera& camera : options.cameras->cameras) camera.intrinsics = Scaled(camera.intrinsics, 3200.0 / 256);
  auto enhanced = Enhance(Ball(0.01), options);
  ASSERT_TRUE(enhanced.ok());
  EXPECT_TRUE(log_->Says("1600")) << log_->text();
  const double assumed = enhanced->report.pixel_size;
  options.train_width = 3200;
  enhanced = Enhance(Ball(0.01), options);
  ASSERT_TRUE(enhanced.ok());
  EXPECT_NEAR(enhanced->report.pixel_size, assumed / 2, 1e-6);
  options.cameras.reset();
  EXPECT_FALSE(Enhance(Ball(0.01), options).ok());  // a training width without cameras
}

TEST_F(EnhanceTest, LeavesAloneWhatSaysNothing) {
  GaussianCloud few = Ball(0.01, 10);
  // Without one nothing can be known to be better.
  for (const char* method : {"auto", "refine"}) {
    EnhanceOptions options;
    options.method = method;
    const auto enhanced = Enhance(few, options);
    ASSERT_TRUE(enhanced.ok()) << enhanced.error().message;
    EXPECT_EQ(enhanced->cloud.log_scales, few.log_scales);
    EXPECT_EQ(enhanced->report.pixel_size_source, PixelSizeSource::kUnknown);
    EXPECT_TRUE(enhanced->cloud.comments.empty());
    EXPECT_TRUE(log_->Says("--pixel-size")) << log_->text();
  }
}

TEST_F(EnhanceTest, RefusesNonsense) {
  EnhanceOptions options;
  options.mode = RenderMode::kClassic;
  options.pixel_size = 0.01;
  options.method = "magic";
  auto enhanced = Enhance(Ball(0.01), options);
  ASSERT_FALSE(enhanced.ok());
  EXPECT_NE(enhanced.error().message.find("filter"), std::string::npos);
  options.method = "auto";
  options.upscale = 0.9;
  EXPECT_FALSE(Enhance(Ball(0.01), options).ok());
  // Whatever the splat shows.
  options.upscale = 4;
  options.pixel_size = -1;
  GaussianCloud invisible = Ball(0.01);
  std::ranges::fill(invisible.opacity_logits, -20.0f);
  EXPECT_FALSE(Enhance(invisible, options).ok());
}

}  // namespace
}  // namespace anchorsplat
