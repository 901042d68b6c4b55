#include "enhance/enhance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <numbers>

#include "core/log.h"
#include "core/random.h"
#include "core/source_dir_for_test.h"
#include "core/text.h"
#include "enhance/enhanced_mark.h"
#include "enhance/filter.h"
#include "enhance/network_for_test.h"
#include "enhance/pixel_size_estimate.h"
#include "formats/cloud_io.h"

namespace anchorsplat {
namespace {

// Keeps what was logged for as long as it lives.
class Recorder : public LogSink {
 public:
  static std::shared_ptr<Recorder> Install() {
    auto recorder = std::make_shared<Recorder>();
    recorder->before_ = SetLogSink(recorder);
    return recorder;
  }
  void Restore() { SetLogSink(before_); }
  void Message(LogLevel, const std::string& text) override { text_ += text + "\n"; }
  void TaskBegin(const std::string&, int64_t) override {}
  void TaskProgress(int64_t, const std::string&) override {}
  void TaskEnd() override {}
  bool Says(const std::string& what) const { return text_.find(what) != std::string::npos; }
  const std::string& text() const { return text_; }

 private:
  std::shared_ptr<LogSink> before_;
  std::string text_;
};

class EnhanceDoor : public testing::Test {
 protected:
  void SetUp() override { log_ = Recorder::Install(); }
  void TearDown() override { log_->Restore(); }
  std::shared_ptr<Recorder> log_;
};

// A ball of opaque discs on its surface, as a fit of a smooth object with pixels of `pixel` leaves them: eroded, that
// is with the variance 0.3 px² taken out of discs that closed the surface.
GaussianCloud Ball(double pixel, int64_t n = 6000) {
  GaussianCloud cloud;
  cloud.Resize(n, 0);
  Random random(11), opacities(12);
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  const double spacing = std::sqrt(4 * std::numbers::pi * 0.25 / static_cast<double>(n));  // radius one half
  for (size_t i = 0; i < static_cast<size_t>(n); ++i) {
    const double y = 1 - 2 * (static_cast<double>(i) + 0.5) / static_cast<double>(n), ring = std::sqrt(1 - y * y);
    const double x = ring * std::cos(golden * static_cast<double>(i)),
                 z = ring * std::sin(golden * static_cast<double>(i));
    cloud.means[3 * i] = static_cast<float>(0.5 * x);
    cloud.means[3 * i + 1] = static_cast<float>(0.5 * y);
    cloud.means[3 * i + 2] = static_cast<float>(0.5 * z);
    // Turns z onto the normal.
    const double w = std::sqrt(0.5 * (1 + z)), s = w > 1e-6 ? 0.5 / w : 0;
    cloud.quats[4 * i] = static_cast<float>(w);
    cloud.quats[4 * i + 1] = static_cast<float>(-y * s);
    cloud.quats[4 * i + 2] = static_cast<float>(x * s);
    cloud.quats[4 * i + 3] = 0;
    const double width = 0.9 * spacing * (1 + 0.2 * random.Normal());
    double eroded = std::sqrt(std::max(0.01 * width * width, width * width - 0.3 * pixel * pixel));
    if (i % 16 == 0) eroded *= random.Uniform(0.01, 1);  // fits shrink some to nothing
    cloud.log_scales[3 * i] = cloud.log_scales[3 * i + 1] = static_cast<float>(std::log(eroded));
    cloud.log_scales[3 * i + 2] = -9;
    cloud.opacity_logits[i] = i % 4 == 1 ? static_cast<float>(opacities.Uniform(-2, 2.9)) : 2.9f;  // 0.948
    for (size_t c = 0; c < 3; ++c) cloud.sh[3 * i + c] = static_cast<float>(random.Uniform(-1, 1));
  }
  return cloud;
}

// Black veils around a ball, as fits of photographs on black keep them: no picture shows them, but alpha does.
GaussianCloud BallInVeils() {
  GaussianCloud cloud = Ball(0.01, 3000), veils = Ball(0.01, 3000);
  Random random(3);
  for (size_t i = 0; i < size_t{3} * 3000; ++i) {
    veils.means[i] *= static_cast<float>(random.Uniform(1.1, 1.8));
    veils.log_scales[i] = std::log(0.08f);
    veils.sh[i] = -2;
  }
  for (float& x : veils.opacity_logits) x = -0.5f;
  EXPECT_TRUE(Append(cloud, veils).ok());
  return cloud;
}

CameraSet CamerasForPixel(double pixel) {
  const Pinhole intrinsics = PinholeFromFov(256, 256, std::numbers::pi / 4);
  auto cameras = OrbitCameras(20, pixel * intrinsics.fx + 0.5, {0, 0, 0}, intrinsics);  // nearest point of the ball
  return std::move(cameras).value();
}

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

TEST_F(EnhanceDoor, ContradictedEstimateIsNotActedOn) {
  constexpr uint64_t kOnlyHere = 4711;
  RegisterNetworkForTest("network", kOnlyHere);
  const GaussianCloud cloud = BallInVeils();
  EnhanceOptions options;
  options.seed = kOnlyHere;
  const auto enhanced = Enhance(cloud, options);
  ASSERT_TRUE(enhanced.ok()) << enhanced.error().message;
  const EnhanceReport& report = enhanced->report;
  EXPECT_EQ(report.pixel_size_source, kCautiousPixelSize);
  ASSERT_TRUE(report.finding && report.finding->contradicted());
  EXPECT_LT(report.pixel_size, report.finding->estimate.size);
  EXPECT_EQ(report.method, "filter");
  EXPECT_TRUE(log_->Says("smaller pixel is taken")) << log_->text();
  EXPECT_FALSE(log_->Says("no single size is right there")) << log_->text();
  EXPECT_TRUE(log_->Says("the filter instead of 'network'")) << log_->text();

  options.method = "network";
  EXPECT_EQ(Enhance(cloud, options)->report.method, "network");
  options.method = "auto";
  options.pixel_size = 0.01;
  const auto given = Enhance(cloud, options);
  ASSERT_TRUE(given.ok());
  EXPECT_EQ(given->report.method, "network");
  EXPECT_EQ(given->report.pixel_size, 0.01);
  EXPECT_FALSE(given->report.finding);
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

// Networks have learned zooms of 2 and more, and nearer than 1.35 they take away from what the filter has.
TEST_F(EnhanceDoor, SmallZoomsAreTheFilters) {
  constexpr uint64_t kOnlyHere = 4714;
  RegisterNetworkForTest("network", kOnlyHere);
  EnhanceOptions options;
  options.seed = kOnlyHere;
  options.pixel_size = 0.01;
  for (const double upscale : {1.2, 1.4}) {
    options.upscale = upscale;
    const auto enhanced = Enhance(Ball(0.01), options);
    ASSERT_TRUE(enhanced.ok()) << enhanced.error().message;
    EXPECT_EQ(enhanced->report.method, upscale < 1.35 ? "filter" : "network");
  }
  EXPECT_TRUE(log_->Says("2 to 8 times closer")) << log_->text();
  options.upscale = 1.2;
  options.method = "network";
  EXPECT_EQ(Enhance(Ball(0.01), options)->report.method, "network") << "who asks for it gets it";
}

// A ball before a sky: what lies around has no pixels that one could know, the ball has.
TEST_F(EnhanceDoor, ANetworkTakesTheThingsWhosePixelsAreKnown) {
  constexpr uint64_t kOnlyHere = 4712;
  static constexpr float kMark = 9;
  RegisterNetworkForTest("network", kOnlyHere, [](EnhanceInput input, const EnhanceOptions& o) {
    LeaveRegion(input);
    std::ranges::fill(input.cloud.opacity_logits, kMark);
    if (o.max_gaussians > 0 && o.max_gaussians < input.cloud.size()) input.cloud.Resize(o.max_gaussians, 0);
    return std::move(input.cloud);
  });
  constexpr int64_t kBall = 6000, kSky = 5000;
  GaussianCloud cloud = Ball(0.01, kBall), sky = Ball(0.01, kSky);
  for (float& x : sky.means) x *= 20;
  for (float& x : sky.log_scales) x += std::log(20.0f);
  ASSERT_TRUE(Append(cloud, sky).ok());
  EnhanceOptions options;
  options.seed = kOnlyHere;
  const auto enhanced = Enhance(cloud, options);
  ASSERT_TRUE(enhanced.ok()) << enhanced.error().message;
  EXPECT_EQ(enhanced->report.method, "network");
  EXPECT_EQ(enhanced->report.pixel_size_source, kCautiousPixelSize);
  ASSERT_EQ(enhanced->report.things.size(), 2u);
  EXPECT_EQ(enhanced->report.steps.size(), 2u);
  EXPECT_TRUE(log_->Says("the filter instead of 'network' for 5,000 of 11,000 Gaussians")) << log_->text();
  EXPECT_TRUE(log_->Says("2 things that lie apart")) << log_->text();
  const auto by_network = [&](const GaussianCloud& of) { return std::ranges::count(of.opacity_logits, kMark); };
  EXPECT_EQ(enhanced->cloud.size(), kBall + kSky);
  EXPECT_EQ(by_network(enhanced->cloud), kBall);
  EXPECT_GT(enhanced->report.seconds_in_all, enhanced->report.seconds);

  // Of a part of both, and of one of them.
  options.region = Region{.low = {-20, -20, -20}, .high = {0, 20, 20}};
  const auto half = Enhance(cloud, options);
  ASSERT_TRUE(half.ok()) << half.error().message;
  EXPECT_EQ(half->cloud.size(), kBall + kSky);
  EXPECT_NEAR(static_cast<double>(by_network(half->cloud)), kBall / 2, 10);
  options.region = Region{.low = {-1, -1, -1}, .high = {1, 1, 1}};
  const auto ball = Enhance(cloud, options);
  ASSERT_TRUE(ball.ok()) << ball.error().message;
  EXPECT_EQ(by_network(ball->cloud), kBall);
  EXPECT_EQ(ball->report.steps.size(), 1u);

  // The filter makes no copies, but its Gaussians count; each has its share.
  options.region.reset();
  SetBudget(options, (kBall + kSky) / 2);
  const auto budget = Enhance(cloud, options);
  ASSERT_TRUE(budget.ok()) << budget.error().message;
  EXPECT_EQ(budget->cloud.size(), (kBall + kSky) / 2);
  EXPECT_EQ(by_network(budget->cloud), kBall / 2);
  SetBudget(options, 2);
  EXPECT_EQ(by_network(Enhance(cloud, options)->cloud), 1);
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
