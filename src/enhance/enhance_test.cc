#include "enhance/enhance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/random.h"
#include "core/source_dir_for_test.h"
#include "core/text.h"
#include "enhance/enhance_door_for_test.h"
#include "enhance/enhanced_mark.h"
#include "enhance/filter.h"
#include "enhance/pixel_size_estimate.h"
#include "formats/cloud_io.h"

namespace anchorsplat {
namespace {

TEST_F(EnhanceDoor, AutoWithoutANetworkIsTheFilter) {
  const GaussianCloud ball = Ball(0.01);
  EnhanceOptions options;
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

TEST_F(EnhanceDoor, DropsBrokenRowsAndSaysSo) {
  GaussianCloud ball = Ball(0.01);
  ball.means[3] = std::nanf("");
  ball.sh[6] = std::numeric_limits<float>::infinity();
  EnhanceOptions options;
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

TEST_F(EnhanceDoor, KeepsWhatIsOpaqueOrFlat) {
  GaussianCloud ball = Ball(0.01);
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  ball.opacity_logits[0] = kInfinity;
  ball.opacity_logits[1] = -kInfinity;
  ball.log_scales[6] = -kInfinity;
  EnhanceOptions options;
  options.pixel_size = 0.01;
  options.method = "filter";
  const auto enhanced = Enhance(ball, options);
  ASSERT_TRUE(enhanced.ok());
  EXPECT_EQ(enhanced->report.dropped, 0);
  EXPECT_EQ(enhanced->cloud.opacity_logits[0], kInfinity);
  EXPECT_TRUE(std::isfinite(enhanced->cloud.log_scales[6])) << "a flat Gaussian gets a width";

  // Surfels: an estimate of a splat that is flat all over is that of the splat.
  const auto estimate = EstimatePixelSize(Ball(0.01));
  for (size_t i = 0; i < ball.log_scales.size(); i += 3) {
    const auto row = ball.log_scales.begin() + static_cast<std::ptrdiff_t>(i);
    *std::min_element(row, row + 3) = -kInfinity;
  }
  const auto flat = EstimatePixelSize(ball);
  ASSERT_TRUE(flat.ok()) << flat.error().message;
  EXPECT_NEAR(std::log2(flat->size / estimate->size), 0, 1);
}

// Their fits have lost less width, and get less back; those of Mip-Splatting next to nothing.
TEST_F(EnhanceDoor, GivesAntialiasedSplatsLess) {
  for (const RenderMode mode : {RenderMode::kAntialiased, RenderMode::kMip}) {
    GaussianCloud ball = Ball(0.01);
    ball.render_mode = mode;
    const GaussianCloud before = ball;
    EnhanceOptions options;
    options.pixel_size = 0.01;
    auto enhanced = Enhance(ball, options);
    ASSERT_TRUE(enhanced.ok());
    const double strength = enhanced->report.filter_strength;
    EXPECT_EQ(strength, DefaultFilterStrength(4, mode));
    EXPECT_LT(strength, DefaultFilterStrength(4) / 2);
    EXPECT_EQ(enhanced->cloud.render_mode, mode);
    EXPECT_TRUE(log_->Says(Cat("the splat is ", NameOf(mode)))) << log_->text();
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
TEST_F(EnhanceDoor, LeavesWhatItMadeAlone) {
  EnhanceOptions options;
  options.pixel_size = 0.01;
  auto once = Enhance(Ball(0.01), options);
  ASSERT_TRUE(once.ok());
  EXPECT_TRUE(IsMarkedEnhanced(once->cloud));
  EXPECT_FALSE(log_->Says("already"));
  const auto twice = Enhance(once->cloud, options);
  ASSERT_TRUE(twice.ok());
  EXPECT_EQ(twice->cloud.log_scales, once->cloud.log_scales);
  EXPECT_EQ(twice->cloud.comments, once->cloud.comments);
  EXPECT_EQ(twice->report.filter_strength, 0);
  EXPECT_TRUE(log_->Says("enhanced already")) << log_->text();
  options.filter_strength = 0.7;
  const auto forced = Enhance(once->cloud, options);
  ASSERT_TRUE(forced.ok());
  EXPECT_NE(forced->cloud.log_scales, once->cloud.log_scales);

  // Nothing was given, so nothing is said.
  options.filter_strength.reset();
  options.upscale = 1;
  EXPECT_FALSE(IsMarkedEnhanced(Enhance(Ball(0.01), options)->cloud));
}

TEST_F(EnhanceDoor, PixelSizeFromCameras) {
  EnhanceOptions options;
  options.cameras = CamerasForPixel(0.0025);  // as the ball looks to the estimate
  const auto enhanced = Enhance(Ball(0.01), options);
  ASSERT_TRUE(enhanced.ok()) << enhanced.error().message;
  EXPECT_EQ(enhanced->report.pixel_size_source, "cameras");
  EXPECT_NEAR(enhanced->report.pixel_size, 0.0041, 0.0002);  // of the median view: they stand all around
  EXPECT_EQ(enhanced->report.camera_rule, "median");
  EXPECT_TRUE(log_->Says("--camera-rule median: the cameras look at one thing")) << log_->text();
  options.camera_rule = CameraPixelRule::kSmallest;
  const auto smallest = Enhance(Ball(0.01), options);
  ASSERT_TRUE(smallest.ok()) << smallest.error().message;
  EXPECT_NEAR(smallest->report.pixel_size, 0.0027, 0.0002);
  EXPECT_EQ(smallest->report.camera_rule, "smallest");
  options.pixel_size = 0.01;
  EXPECT_FALSE(Enhance(Ball(0.01), options).ok());  // both
}

// Cameras and regions are in the world, wherever the means begin.
TEST_F(EnhanceDoor, FromAnOriginIsTheSame) {
  const WorldOrigin origin = {500000, 4500000, 0}, back = {-500000, -4500000, 0};
  EnhanceOptions options;
  options.method = "filter";
  options.cameras = CamerasForPixel(0.01);
  options.region = Region{.low = {0.5, 0, 0}, .high = {}, .radius = 0.4};
  const auto at_zero = Enhance(Ball(0.01), options);
  ASSERT_TRUE(at_zero.ok()) << at_zero.error().message;
  ASSERT_GT(at_zero->report.region_in, 100);
  GaussianCloud far = Ball(0.01);
  far.origin = origin;
  far.double_means = true;
  options.cameras = FromOrigin(*options.cameras, back);
  options.region = FromOrigin(*options.region, back);
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

TEST_F(EnhanceDoor, WarnsWhenCamerasAreNotThoseOfTheSplat) {
  EnhanceOptions options;
  options.cameras = CamerasForPixel(0.05);
  const auto cautious = Enhance(Ball(0.01), options);
  ASSERT_TRUE(cautious.ok());
  EXPECT_TRUE(log_->Says("Are these its training cameras")) << log_->text();
  EXPECT_LT(cautious->report.pixel_size, 0.02) << "as it looks, so that nothing is blurred";
  // Whoever says a strength, or the mode, means these cameras.
  options.filter_strength = 0.7;
  EXPECT_GT(Enhance(Ball(0.01), options)->report.pixel_size, 0.04);
  options.filter_strength.reset();
  GaussianCloud tagged = Ball(0.01);
  tagged.render_mode = RenderMode::kClassic;
  EXPECT_LT(Enhance(tagged, options)->report.pixel_size, 0.02) << "a tag says nothing about cameras";
  options.given = {"mode"};
  EXPECT_GT(Enhance(tagged, options)->report.pixel_size, 0.04);
  options.given.clear();
  // Larger than the cameras' pixels it may look: that is only said.
  options.cameras = CamerasForPixel(0.001);
  EXPECT_LT(Enhance(Ball(0.01), options)->report.pixel_size, 0.004);
  EXPECT_TRUE(log_->Says("are these its training cameras")) << log_->text();
}

TEST_F(EnhanceDoor, SaysWhichTrainingWidthItAssumes) {
  EnhanceOptions options;
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

TEST_F(EnhanceDoor, EstimateFollowsTheScaleOfTheCloud) {
  const GaussianCloud ball = Ball(0.01);
  const auto estimate = EstimatePixelSize(ball);
  ASSERT_TRUE(estimate.ok()) << estimate.error().message;
  EXPECT_LE(estimate->low, estimate->size);
  EXPECT_GE(estimate->high, estimate->size);
  for (const float factor : {1e-5f, 1e5f}) {
    GaussianCloud scaled = ball;
    for (float& x : scaled.means) x *= factor;
    for (float& x : scaled.log_scales) x += std::log(factor);
    const auto other = EstimatePixelSize(scaled);
    ASSERT_TRUE(other.ok());
    EXPECT_NEAR(other->size / estimate->size / double{factor}, 1, 0.02) << factor;
    EXPECT_NEAR(other->high / other->low, estimate->high / estimate->low, 0.05) << factor;
  }
}

// Two real fits whose training pixel is 1.7 / 309.02 px.
TEST_F(EnhanceDoor, EstimateIsNearTheTruthOnRealFits) {
  for (const char* object : {"biplane", "stone_lantern"}) {
    const auto cloud = ReadCloud(SourceDirForTest().string() + "/examples/" + object + "/input.ply");
    ASSERT_TRUE(cloud.ok()) << cloud.error().message;
    const auto estimate = EstimatePixelSize(*cloud);
    ASSERT_TRUE(estimate.ok());
    EXPECT_GT(estimate->size, 0.8 * 0.0055013) << object;
    EXPECT_LT(estimate->size, 1.2 * 0.0055013) << object;
    EXPECT_LT(estimate->low, 0.0055013) << object;
    EXPECT_GT(estimate->high, 0.0055013) << object;
  }
}

TEST_F(EnhanceDoor, EstimateTellsHowManyGaussiansShow) {
  GaussianCloud ball = Ball(0.01);
  const auto all = EstimatePixelSize(ball);
  for (size_t i = 0; i < ball.opacity_logits.size(); i += 4) ball.opacity_logits[i] = -5;
  const auto fewer = EstimatePixelSize(ball);
  ASSERT_TRUE(all.ok() && fewer.ok());
  EXPECT_NEAR(fewer->showing, 0.75 * all->showing, 0.01);
  EXPECT_GT(all->showing, 0.9);
}

// What captures of real places have behind their subject must not decide.
TEST_F(EnhanceDoor, EstimateIsNotMovedByGiantsAndSkies) {
  const auto example = ReadCloud(SourceDirForTest().string() + "/examples/biplane/input.ply");
  ASSERT_TRUE(example.ok());
  const double plain = EstimatePixelSize(*example)->size;
  struct Addition {
    int count;
    float log_scale, distance;
  };
  for (const Addition added : {Addition{1, 3, 50}, {1, 5, 0}, {200, 1.5f, 20}, {3, 80, 1}, {100, 0, 8}}) {
    GaussianCloud cloud = *example;
    std::vector<int64_t> rows(static_cast<size_t>(added.count), 0);
    GaussianCloud more = *Subset(cloud, rows);
    Random random(7);
    for (size_t i = 0; i < rows.size(); ++i) {
      double direction[3], norm = 0;
      for (double& d : direction) {
        d = random.Normal();
        norm += d * d;
      }
      for (size_t a = 0; a < 3; ++a) {
        more.means[3 * i + a] = static_cast<float>(added.distance * direction[a] / std::sqrt(norm));
        more.log_scales[3 * i + a] = added.log_scale;
      }
      more.opacity_logits[i] = 4;
    }
    ASSERT_TRUE(Append(cloud, more).ok());
    const auto estimate = EstimatePixelSize(cloud);
    ASSERT_TRUE(estimate.ok()) << estimate.error().message;
    EXPECT_NEAR(estimate->size / plain, 1, 0.1) << added.count << " of ln scale " << added.log_scale;
  }
}

// Only a part of a large cloud is looked at, and it is the same part every time.
TEST_F(EnhanceDoor, EstimateOfALargeCloud) {
  GaussianCloud cloud = Ball(0.01, 200'500);
  const auto estimate = EstimatePixelSize(cloud);
  ASSERT_TRUE(estimate.ok()) << estimate.error().message;
  EXPECT_TRUE(std::isfinite(estimate->size) && estimate->size > 0);
  EXPECT_EQ(EstimatePixelSize(cloud)->size, estimate->size);
}

TEST_F(EnhanceDoor, EstimateRefusesWhatSaysNothing) {
  GaussianCloud few = Ball(0.01, 10);
  EXPECT_FALSE(EstimatePixelSize(few).ok());
  GaussianCloud invisible = Ball(0.01);
  for (float& x : invisible.opacity_logits) x = -8;
  EXPECT_FALSE(EstimatePixelSize(invisible).ok());
  // Without one nothing can be known to be better.
  for (const char* method : {"auto", "refine"}) {
    EnhanceOptions options;
    options.method = method;
    const auto enhanced = Enhance(few, options);
    ASSERT_TRUE(enhanced.ok()) << enhanced.error().message;
    EXPECT_EQ(enhanced->cloud.log_scales, few.log_scales);
    EXPECT_EQ(enhanced->report.pixel_size_source, kUnknownPixelSize);
    EXPECT_TRUE(enhanced->cloud.comments.empty());
    EXPECT_TRUE(log_->Says("--pixel-size")) << log_->text();
  }
}

// Where the estimate is contradicted, too, each Gaussian is judged by itself, as without cameras.
TEST_F(EnhanceDoor, ImpossibleCamerasOfAContradictedSplatAreNoWorseThanNone) {
  const GaussianCloud veiled = BallInVeils();
  EnhanceOptions options;
  const auto without = Enhance(veiled, options);
  ASSERT_TRUE(without.ok()) << without.error().message;
  ASSERT_EQ(without->report.pixel_size_source, kCautiousPixelSize);
  options.cameras = CamerasForPixel(2);
  const auto judged = Enhance(veiled, options);
  ASSERT_TRUE(judged.ok()) << judged.error().message;
  EXPECT_EQ(judged->report.pixel_size_source, kCautiousPixelSize) << log_->text();
  for (size_t k = 0; k < judged->cloud.log_scales.size(); ++k) {
    ASSERT_LE(judged->cloud.log_scales[k], without->cloud.log_scales[k] + 1e-5f) << k;
  }
}

// One thing whose Gaussians lie further and further apart: near and far in a street.
TEST_F(EnhanceDoor, UnevenSpacingsHaveNoOnePixel) {
  GaussianCloud cloud = Ball(0.01);
  for (size_t i = 0; i < static_cast<size_t>(cloud.size()); ++i) {
    const float grown = std::exp(2.5f * cloud.means[3 * i]);
    for (size_t a = 0; a < 3; ++a) {
      cloud.means[3 * i + a] *= grown;
      cloud.log_scales[3 * i + a] += std::log(grown);
    }
  }
  const auto enhanced = Enhance(cloud, {});
  ASSERT_TRUE(enhanced.ok()) << enhanced.error().message;
  EXPECT_EQ(enhanced->report.pixel_size_source, kCautiousPixelSize);
  EXPECT_TRUE(enhanced->report.things.empty());
  EXPECT_TRUE(log_->Says("no single size is right there")) << log_->text();
}

TEST_F(EnhanceDoor, RefusesNonsense) {
  EnhanceOptions options;
  options.pixel_size = 0.01;
  options.method = "magic";
  auto enhanced = Enhance(Ball(0.01), options);
  ASSERT_FALSE(enhanced.ok());
  EXPECT_NE(enhanced.error().message.find("filter"), std::string::npos);
  options.method = "auto";
  options.upscale = 0.9;
  EXPECT_FALSE(Enhance(Ball(0.01), options).ok());
}

}  // namespace
}  // namespace anchorsplat
