#include "enhance/network_choice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <span>
#include <string>
#include <utility>

#include "enhance/enhance.h"
#include "enhance/enhance_door_for_test.h"
#include "enhance/filter.h"
#include "enhance/network_for_test.h"

// Which splats a network enhances that nobody asked for, and with which pixel sizes.
namespace anchorsplat {
namespace {

TEST_F(EnhanceDoor, ContradictedEstimateIsNotActedOn) {
  constexpr uint64_t kOnlyHere = 4711;
  static Buffer<float> sizes;
  RegisterNetworkForTest("network", kOnlyHere, [](EnhanceInput input, const EnhanceOptions&) {
    sizes = input.pixel_sizes;
    return std::move(input.cloud);
  });
  const GaussianCloud cloud = BallInVeils();
  EnhanceOptions options;
  options.seed = kOnlyHere;
  const auto enhanced = Enhance(cloud, options);
  ASSERT_TRUE(enhanced.ok()) << enhanced.error().message;
  const EnhanceReport& report = enhanced->report;
  EXPECT_EQ(report.pixel_size_source, kCautiousPixelSize);
  ASSERT_TRUE(report.finding && report.finding->contradicted());
  EXPECT_LT(report.pixel_size, report.finding->estimate.size);
  EXPECT_TRUE(log_->Says("smaller pixel is taken")) << log_->text();
  EXPECT_FALSE(log_->Says("no single size is right there")) << log_->text();
  // A network at smaller pixels gives back more than the filter does.
  EXPECT_EQ(report.method, "network");
  ASSERT_FALSE(sizes.empty());
  EXPECT_LE(std::ranges::max(sizes), static_cast<float>(report.finding->size));

  options.pixel_size = 0.01;
  const auto given = Enhance(cloud, options);
  ASSERT_TRUE(given.ok());
  EXPECT_EQ(given->report.method, "network");
  EXPECT_EQ(given->report.pixel_size, 0.01);
  EXPECT_FALSE(given->report.finding);
}

// As large as they lie apart, and no pixel made them so.
TEST_F(EnhanceDoor, BallsAreTheFilters) {
  constexpr uint64_t kOnlyHere = 4715;
  RegisterNetworkForTest("network", kOnlyHere);
  GaussianCloud balls = Ball(0.01);
  for (size_t i = 0; i < static_cast<size_t>(balls.size()); ++i) balls.log_scales[3 * i + 2] = balls.log_scales[3 * i];
  EnhanceOptions options;
  options.seed = kOnlyHere;
  options.filter_strength = DefaultFilterStrength(4);
  EXPECT_EQ(Enhance(Ball(0.01), options)->report.method, "network");
  const auto enhanced = Enhance(balls, options);
  ASSERT_TRUE(enhanced.ok()) << enhanced.error().message;
  EXPECT_EQ(enhanced->report.method, "filter");
  EXPECT_TRUE(log_->Says("the filter instead of 'network'")) << log_->text();
  options.method = "network";
  EXPECT_EQ(Enhance(balls, options)->report.method, "network") << "who asks for it gets it";
}

class NetworkChoice : public EnhanceDoor {
 protected:
  static constexpr uint64_t kOnlyHere = 4716;
  void SetUp() override {
    EnhanceDoor::SetUp();
    RegisterNetworkForTest("network", kOnlyHere);
    options_.seed = kOnlyHere;
    report_.pixel_size = 0.01;
    report_.pixel_size_source = "estimated";
  }
  // The method and the pixel size that it gets.
  std::pair<std::string, double> Choose(GaussianCloud cloud = Ball(0.01)) {
    MethodPlan plan = PlanEnhancement(options_).value();
    EnhanceInput input;
    input.cloud = std::move(cloud);
    input.pixel_sizes = {static_cast<float>(report_.pixel_size)};
    input.pixel_size = report_.pixel_size;
    input.softness = softness_;
    EnhanceReport report = report_;
    ChooseNetwork(options_, false, plan, input, report);
    EXPECT_FLOAT_EQ(input.pixel_sizes[0], static_cast<float>(report.pixel_size));
    EXPECT_EQ(input.pixel_size, report.pixel_size);
    return {plan.Name(), report.pixel_size};
  }

  EnhanceOptions options_;
  EnhanceReport report_;
  double softness_ = 1;
};

// After soft pictures outlines may say half too much.
TEST_F(NetworkChoice, RoughEstimatesAreTakenSmaller) {
  report_.finding.emplace().size = 0.01;
  PixelSizeEstimate& estimate = report_.finding->estimate;
  estimate.size = 0.01;
  estimate.low = 0.005;
  estimate.high = 0.014;
  EXPECT_EQ(Choose(), std::pair(std::string("network"), 0.01));
  estimate.high = 0.016;
  EXPECT_EQ(Choose(), std::pair(std::string("network"), 0.01)) << "not lowered by softness";
  estimate.softness = 0.89;
  EXPECT_EQ(Choose(), std::pair(std::string("network"), 0.01 * 0.8));
  EXPECT_TRUE(log_->Says("that is rough")) << log_->text();
  options_.method = "network";
  EXPECT_EQ(Choose(), std::pair(std::string("network"), 0.01)) << "who asks for it gets it";
  options_.method = "auto";
  estimate.high = 0.014;
  softness_ = 0.65;
  EXPECT_EQ(Choose(), std::pair(std::string("network"), 0.01)) << "a part of the pictures";
  softness_ = 0.55;
  EXPECT_EQ(Choose(), std::pair(std::string("network"), 0.01 * 0.8));
  report_.finding.reset();
  report_.pixel_size_source = "cameras";
  EXPECT_EQ(Choose(), std::pair(std::string("network"), 0.01 * 0.8));
  EXPECT_TRUE(log_->Says("soft pictures")) << log_->text();
}

TEST_F(NetworkChoice, SaysItsShareBefore) {
  const GaussianCloud ball = Ball(0.01);
  PixelSizeFinding finding;
  finding.estimate.low = 0.005;
  finding.estimate.high = 0.014;
  EXPECT_EQ(ShareForNetwork(TrainedKind::kClassic, ball, ball.size(), finding), 1);
  EXPECT_EQ(ShareForNetwork(std::nullopt, ball, ball.size(), finding), 1);
  EXPECT_EQ(ShareForNetwork(TrainedKind::kUnclear, ball, ball.size(), finding), 0.35);
  EXPECT_EQ(ShareForNetwork(TrainedKind::kUnclear, ball, 1999, finding), 1);
  finding.estimate.high = 0.016;
  EXPECT_EQ(ShareForNetwork(std::nullopt, ball, ball.size(), finding), 1);
  finding.estimate.softness = 0.89;
  EXPECT_EQ(ShareForNetwork(std::nullopt, ball, ball.size(), finding), 0.8);
  EXPECT_EQ(ShareForNetwork(TrainedKind::kRaised, ball, ball.size(), finding), 1);
  EXPECT_EQ(ShareForNetwork(TrainedKind::kEnhanced, ball, ball.size(), finding), 1);
  finding.contradictions = {"small"};
  EXPECT_EQ(ShareForNetwork(TrainedKind::kUnclear, ball, ball.size(), finding), 1);
}

TEST_F(NetworkChoice, WhatIsUnclearTakesSmallPixels) {
  report_.looks = TrainedKind::kUnclear;
  EXPECT_EQ(Choose(), std::pair(std::string("network"), 0.01 * 0.35));
  EXPECT_EQ(Choose(Ball(0.01, 1999)), std::pair(std::string("filter"), 0.01)) << "few";
  GaussianCloud round = Ball(0.01);
  for (size_t i = 0; i < static_cast<size_t>(round.size()); ++i) {
    round.log_scales[3 * i + 2] = round.log_scales[3 * i] + std::log(0.6f);
  }
  EXPECT_EQ(Choose(round), std::pair(std::string("filter"), 0.01)) << "made of points";
  report_.pixel_size_source = kCautiousPixelSize;  // small already
  EXPECT_EQ(Choose(), std::pair(std::string("network"), 0.01));
  EXPECT_EQ(Choose(round), std::pair(std::string("filter"), 0.01));
  report_.finding.emplace().contradictions = {"crowded"};
  EXPECT_EQ(Choose(), std::pair(std::string("filter"), 0.01)) << "nothing is known, as of captures";
  report_.looks = TrainedKind::kClassic;
  EXPECT_EQ(Choose(), std::pair(std::string("network"), 0.01)) << "its kind is";
  report_.finding.reset();
  report_.looks = TrainedKind::kRaised;
  EXPECT_EQ(Choose(), std::pair(std::string("filter"), 0.01));
  report_.looks = TrainedKind::kClassic;
  EXPECT_EQ(Choose(), std::pair(std::string("network"), 0.01));
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

}  // namespace
}  // namespace anchorsplat
