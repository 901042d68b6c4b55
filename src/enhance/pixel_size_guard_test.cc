#include "enhance/pixel_size_guard.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "core/random.h"
#include "core/source_dir_for_test.h"
#include "enhance/filter.h"
#include "enhance/gaussian_regions.h"
#include "formats/cloud_io.h"

namespace anchorsplat {
namespace {

constexpr double kTruth = 0.0055013;  // of both examples: 1.7 / 309.02 px

GaussianCloud Example(const char* object) {
  auto cloud = ReadCloud(SourceDirForTest() / "examples" / object / "input.ply");
  EXPECT_TRUE(cloud.ok());
  return cloud.ok() ? *std::move(cloud) : GaussianCloud{};
}

auto LargerThan(double size) {
  return [size](float own) { return double{own} > size; };
}

struct Dust {
  int64_t count;
  double size;  // world units, of all axes
  double opacity;
  float colour;   // of all channels
  double radius;  // of the ball it fills
};

void Add(GaussianCloud& cloud, const Dust& dust) {
  GaussianCloud more;
  more.Resize(dust.count, 0);
  Random random(17);
  std::fill(more.log_scales.begin(), more.log_scales.end(), static_cast<float>(std::log(dust.size)));
  std::fill(more.quats.begin(), more.quats.end(), 0.5f);
  std::fill(more.opacity_logits.begin(), more.opacity_logits.end(),
            static_cast<float>(std::log(dust.opacity / (1 - dust.opacity))));
  std::fill(more.sh.begin(), more.sh.end(), (dust.colour - 0.5f) / 0.2820948f);
  for (size_t i = 0; i < static_cast<size_t>(dust.count); ++i) {
    double at[3], norm = 0;
    for (double& x : at) {
      x = random.Normal();
      norm += x * x;
    }
    const double r = dust.radius * std::cbrt(random.Uniform()) / std::sqrt(norm);
    for (size_t a = 0; a < 3; ++a) more.means[3 * i + a] = static_cast<float>(r * at[a]);
  }
  ASSERT_TRUE(Append(cloud, more).ok());
}

// A splat that was fitted to small pictures says the same thing in all ways.
TEST(PixelSizeGuard, FitsOfSmallPicturesPass) {
  for (const char* object : {"biplane", "stone_lantern"}) {
    const auto found = FindPixelSize(Example(object));
    ASSERT_TRUE(found.ok()) << found.error().message;
    EXPECT_FALSE(found->contradicted()) << object << ": " << found->contradictions.front();
    EXPECT_EQ(found->size, found->estimate.size);
  }
}

// On a square grid eight neighbours lie within √2 of its step, and a circle of that radius holds 2π of its squares.
TEST(PixelSizeGuard, SpacingIsTheSideOfASquareOfTheSurface) {
  for (const float step : {1e-3f, 1.0f, 700.0f}) {
    GaussianCloud grid;
    grid.Resize(3600, 0);
    std::fill(grid.log_scales.begin(), grid.log_scales.end(), std::log(0.3f * step));
    std::fill(grid.quats.begin(), grid.quats.end(), 0.5f);
    std::fill(grid.opacity_logits.begin(), grid.opacity_logits.end(), 3.0f);
    std::fill(grid.sh.begin(), grid.sh.end(), 0.0f);
    std::fill(grid.means.begin(), grid.means.end(), 0.0f);
    for (int64_t i = 0; i < grid.size(); ++i) {
      grid.means[static_cast<size_t>(3 * i)] = step * static_cast<float>(i % 60);
      grid.means[static_cast<size_t>(3 * i + 1)] = step * static_cast<float>(i / 60);
    }
    const auto evidence = GatherPixelSizeEvidence(grid);
    ASSERT_TRUE(evidence.ok()) << evidence.error().message;
    EXPECT_NEAR(evidence->spacing / double{step}, std::sqrt(std::numbers::pi / 4), 1e-4) << step;
  }
}

// What fits of photographs on black keep around the object: black Gaussians that cover what is behind them with black,
// and so are seen in no picture, but whose alpha makes outlines wide.
TEST(PixelSizeGuard, BlackVeilsAreSeenThrough) {
  GaussianCloud cloud = Example("biplane");
  Add(cloud, {6000, 0.05, 0.3, 0.0f, 0.9});  // veils
  Add(cloud, {200, 0.01, 0.9, 0.3f, 1.0});   // floaters
  const auto found = FindPixelSize(cloud);
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_GT(found->estimate.size, 2 * kTruth) << "the veils do not mislead the outlines: a test of nothing";
  ASSERT_TRUE(found->contradicted()) << found->estimate.size;
  EXPECT_LT(found->size, kTruth);
  EXPECT_GT(found->size, 0.8 * kTruth) << "without them the outlines tell";
  bool black = false;
  for (const std::string& sentence : found->contradictions) black |= sentence.find("black") != std::string::npos;
  EXPECT_TRUE(black);
}

// A capture: many Gaussians on a surface whose outline is soft, as they are where a subject was cut out of its place.
TEST(PixelSizeGuard, ManySmallGaussiansWithSoftOutlinesAreNotBlurred) {
  GaussianCloud cloud = Example("stone_lantern");
  for (float& x : cloud.log_scales) x -= std::log(2.0f);
  const GaussianCloud part = cloud;
  for (int copy = 1; copy < 4; ++copy) {  // four times as many, half as large: the detail of half the pixel
    GaussianCloud more = part;
    Random random(static_cast<uint64_t>(copy));
    for (float& x : more.means) x += static_cast<float>(0.004 * random.Normal());
    ASSERT_TRUE(Append(cloud, more).ok());
  }
  Add(cloud, {4000, 0.04, 0.15, 0.5f, 0.5});
  const auto found = FindPixelSize(cloud);
  ASSERT_TRUE(found.ok()) << found.error().message;
  // The lantern's pixels are 0.0055; whether the estimate sees that these are half of them, or the evidence against it.
  EXPECT_LT(found->size, 0.5 * 0.0055) << found->estimate.size;
}

// Judged by what is in the splat: an estimate of its outlines alone, twice the pixel, is brought down to where it does
// next to nothing to half of the Gaussians of any region.
TEST(PixelSizeGuard, AContradictedEstimateIsNextToHarmless) {
  const GaussianCloud cloud = Example("stone_lantern");
  const auto evidence = GatherPixelSizeEvidence(cloud);
  ASSERT_TRUE(evidence.ok());
  const double crowded = std::sqrt(4 * MostGaussiansPerPixel(evidence->gaussians, 1)) * evidence->spacing;
  const PixelSizeFinding found = Judge({crowded, crowded, crowded}, *evidence);
  ASSERT_TRUE(found.contradicted());
  EXPECT_LT(found.size, 0.7 * kTruth);
  const Buffer<float> sizes = CautiousPixelSizes(cloud, found);
  const GaussianRegions regions(cloud);
  int64_t looked_at = 0, wider = 0;
  for (int64_t i = 0; i < cloud.size(); i += 7) {
    const double width = regions.Around(cloud.means.data() + 3 * i).width;
    const double added =
        0.3 * (DefaultFilterStrength(4) - 1.0 / 16) * std::pow(double{sizes[static_cast<size_t>(i)]}, 2);
    ++looked_at;
    wider += std::sqrt(width * width + added) > 1.08 * width ? 1 : 0;
  }
  EXPECT_LT(wider, looked_at / 20) << "of " << looked_at;
}

// Cutting a splat makes outlines as soft as its Gaussians are large. They do not count, and what is left is trusted
// less.
TEST(PixelSizeGuard, APartIsNoMoreBlurredThanTheWhole) {
  const GaussianCloud whole = Example("stone_lantern");
  std::vector<int64_t> rows;
  for (int64_t i = 0; i < whole.size(); ++i) {
    const float* p = whole.means.data() + 3 * i;
    if (p[0] + 0.3f * p[1] < 0.05f) rows.push_back(i);
  }
  const auto found = FindPixelSize(Subset(whole, rows).value());
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_TRUE(found->part);
  EXPECT_LT(found->size, found->estimate.size);
  EXPECT_FALSE(found->contradicted()) << found->contradictions.front();
  EXPECT_GT(found->size, 0.6 * kTruth);
  EXPECT_LT(found->size, 1.1 * kTruth);
}

TEST(PixelSizeGuard, PartsAreCrowdedSooner) {
  PixelSizeEstimate estimate = {.size = 0.01, .low = 0.008, .high = 0.012, .showing = 0.7};
  // 0.7 Gaussians on a pixel: nothing for so few, but too many for a part of no one knows how many.
  const PixelSizeEvidence evidence = {.gaussians = 5000,
                                      .all = 6000,
                                      .spacing = 0.01 / std::sqrt(0.7),
                                      .small_axis = 0.01,
                                      .harmless = 0.7 * 0.004,
                                      .without_black = 0};
  EXPECT_FALSE(Judge(estimate, evidence).part);
  EXPECT_FALSE(Judge(estimate, evidence).contradicted());
  estimate.cut_outlines = 0.06;  // as fits have that nobody cut
  EXPECT_FALSE(Judge(estimate, evidence).part);
  EXPECT_EQ(Judge(estimate, evidence).size, 0.01);
  estimate.cut_outlines = 0.18;  // the feet of a chair of few steps
  EXPECT_TRUE(Judge(estimate, evidence).part);
  EXPECT_FALSE(Judge(estimate, evidence).contradicted());
  estimate.cut_outlines = 0.3;
  EXPECT_TRUE(Judge(estimate, evidence).part);
  ASSERT_TRUE(Judge(estimate, evidence).contradicted());
  EXPECT_NE(Judge(estimate, evidence).contradictions[0].find("parts that were cut out of fits"), std::string::npos);

  PixelSizeEvidence sparse = evidence;
  sparse.spacing = 0.02;
  EXPECT_FALSE(Judge(estimate, sparse).contradicted());
  EXPECT_NEAR(Judge(estimate, sparse).size, 0.01 * std::exp(-0.09), 1e-9);
  estimate.cut_outlines = 0.95;
  ASSERT_TRUE(Judge(estimate, sparse).contradicted());
  EXPECT_NE(Judge(estimate, sparse).contradictions[0].find("95 % of its outlines"), std::string::npos);
  EXPECT_DOUBLE_EQ(Judge(estimate, sparse).size, 0.7 * 0.004);
}

// A subject before a sky of coarse Gaussians: what is harmless for the sky would blur the subject.
TEST(PixelSizeGuard, FineGaussiansAmongCoarseOnesStay) {
  GaussianCloud cloud = Example("biplane");
  const GaussianCloud subject = cloud;
  Add(cloud, {80'000, 0.3, 0.95, 0.6f, 8});
  const auto found = FindPixelSize(cloud);
  ASSERT_TRUE(found.ok()) << found.error().message;
  ASSERT_TRUE(found->contradicted());
  EXPECT_GT(found->size, 3 * kTruth) << "a test of nothing";
  ASSERT_LT(found->least, found->size);
  const Buffer<float> sizes = CautiousPixelSizes(cloud, *found);
  ASSERT_EQ(std::ssize(sizes), cloud.size());
  // The subject's own pixels are larger than what its Gaussians get.
  const std::span<const float> own = std::span(sizes).first(static_cast<size_t>(subject.size()));
  EXPECT_EQ(std::ranges::count_if(own, LargerThan(kTruth)), 0) << found->least / kTruth;
  EXPECT_LT(std::ranges::count_if(own, LargerThan(0.6 * kTruth)), std::ssize(own) / 10);
}

// A ground of a few large Gaussians, or clutter around an object, says nothing about the object's pixels.
TEST(PixelSizeGuard, OutlinesOfCoarseGaussiansDoNotCount) {
  const GaussianCloud subject = Example("stone_lantern");
  for (const int64_t count : {200, 500, 1000}) {
    GaussianCloud ground;
    ground.Resize(count, 0);
    Random random(static_cast<uint64_t>(count));
    for (int64_t i = 0; i < count; ++i) {
      float* const at = ground.means.data() + 3 * i;
      at[0] = static_cast<float>(random.Uniform(-2, 2));
      at[1] = -0.53f;  // the lantern ends at −0.5
      at[2] = static_cast<float>(random.Uniform(-2, 2));
      float* const scales = ground.log_scales.data() + 3 * i;
      scales[0] = scales[2] = std::log(0.1f);
      scales[1] = std::log(0.002f);
      std::copy_n(std::array{1.0f, 0.0f, 0.0f, 0.0f}.data(), 4, ground.quats.data() + 4 * i);
    }
    std::ranges::fill(ground.opacity_logits, 3.0f);
    std::ranges::fill(ground.sh, 0.5f);
    GaussianCloud cloud = subject;
    std::erase_if(cloud.comments, [](const std::string&) { return true; });
    ASSERT_TRUE(Append(cloud, ground).ok());
    const auto found = FindPixelSize(cloud);
    ASSERT_TRUE(found.ok()) << found.error().message;
    EXPECT_GT(found->estimate.coarse_outlines, 0.3) << "a test of nothing";
    EXPECT_LT(found->size, 1.2 * kTruth) << count;
    EXPECT_GT(found->size, 0.8 * kTruth) << count;
  }
  const auto alone = FindPixelSize(subject);
  ASSERT_TRUE(alone.ok()) << alone.error().message;
  EXPECT_LT(alone->estimate.coarse_outlines, 0.02);
}

// Fitted to pixels of different size; the estimate is that of the larger one.
TEST(PixelSizeGuard, OneThingBesideAnotherThatIsThreeTimesAsLarge) {
  for (const float scale : {1.0f, 3.0f}) {
    GaussianCloud cloud = Example("stone_lantern");
    for (float& x : cloud.means) x *= scale;
    for (float& x : cloud.log_scales) x += std::log(scale);
    for (size_t i = 0; i < cloud.means.size(); i += 3) cloud.means[i] += 3 * scale;
    ASSERT_TRUE(Append(cloud, Example("biplane")).ok());
    const auto found = FindPixelSize(cloud);
    ASSERT_TRUE(found.ok()) << found.error().message;
    ASSERT_EQ(found->contradicted(), scale > 1);
    if (scale > 1) {
      EXPECT_NE(found->contradictions[0].find("times as far apart"), std::string::npos) << found->contradictions[0];
      const Buffer<float> sizes = CautiousPixelSizes(cloud, *found);
      const auto own = std::span(sizes).last(static_cast<size_t>(Example("biplane").size()));
      EXPECT_LT(std::ranges::count_if(own, LargerThan(kTruth)), std::ssize(own) / 100);
      EXPECT_LT(std::ranges::count_if(own, LargerThan(0.6 * kTruth)), std::ssize(own) / 10);
    }
  }
}

// A fine thing in the midst of a coarse one that hides it from the quantiles.
TEST(PixelSizeGuard, AFewThatLieMuchCloserAreNotBlurred) {
  GaussianCloud cloud = Example("stone_lantern");
  GaussianCloud fine = Example("biplane");
  fine.Resize(1500, fine.sh_degree);
  for (float& x : fine.means) x *= 0.05f;
  for (float& x : fine.log_scales) x += std::log(0.05f);
  ASSERT_TRUE(Append(cloud, fine).ok());
  const auto found = FindPixelSize(cloud);
  ASSERT_TRUE(found.ok()) << found.error().message;
  ASSERT_FALSE(found->contradicted()) << found->contradictions.front();
  ASSERT_GT(found->closer, 0);
  const Buffer<float> sizes = CautiousPixelSizes(cloud, *found);
  const auto of_fine = std::span(sizes).last(1500), of_coarse = std::span(sizes).first(sizes.size() - 1500);
  EXPECT_LT(std::ranges::count_if(of_fine, LargerThan(0.1 * kTruth)), 15);
  EXPECT_GT(std::ranges::count_if(of_coarse, LargerThan(0.9 * kTruth)), std::ssize(of_coarse) * 95 / 100);
}

TEST(PixelSizeGuard, ManyAtOnePlaceSayNothing) {
  GaussianCloud cloud = Example("biplane");
  std::ranges::fill(cloud.means, 0.5f);
  const auto found = FindPixelSize(cloud);
  ASSERT_TRUE(!found.ok() || found->contradicted());
}

TEST(PixelSizeGuard, EachEvidenceContradictsOnItsOwn) {
  PixelSizeEstimate estimate = {0.01, 0.008, 0.012};
  estimate.showing = 0.3;
  const PixelSizeEvidence plain = {.gaussians = 20'000,
                                   .all = 30'000,
                                   .spacing = 0.02,
                                   .small_axis = 0.01,
                                   .harmless = 0.7 * 0.004,
                                   .without_black = 0};
  EXPECT_FALSE(Judge(estimate, plain).contradicted());
  EXPECT_EQ(Judge(estimate, plain).size, 0.01);
  EXPECT_FALSE(Judge(estimate, plain).rough());
  PixelSizeEstimate wide = estimate;
  wide.high = 3.1 * wide.low;
  EXPECT_TRUE(Judge(wide, plain).rough());

  // Cameras with larger pixels than it looks like.
  EXPECT_TRUE(IsSharperThanFitsTo(0.0175, Judge(estimate, plain)));
  EXPECT_FALSE(IsSharperThanFitsTo(0.017, Judge(estimate, plain)));
  PixelSizeEstimate wider = estimate;
  wider.high = 0.018;
  EXPECT_FALSE(IsSharperThanFitsTo(0.0175, Judge(wider, plain))) << "they lie within its interval";
  EXPECT_TRUE(IsSharperThanFitsTo(0.0185, Judge(wider, plain)));
  PixelSizeEstimate strange = estimate;
  strange.strangeness = 2;
  EXPECT_FALSE(IsSharperThanFitsTo(0.0175, Judge(strange, plain)));
  PixelSizeEstimate soft = estimate;
  soft.softness = 0.9;
  EXPECT_FALSE(IsSharperThanFitsTo(0.0175, Judge(soft, plain))) << "it was lowered";
  EXPECT_FALSE(IsSharperThanFitsTo(0.03, Judge(wide, plain))) << "a rough estimate says nothing against them";

  PixelSizeEvidence crowded = plain;
  crowded.spacing = 0.006;  // 2.8 on a pixel
  EXPECT_TRUE(Judge(estimate, crowded).contradicted());
  EXPECT_NE(Judge(estimate, crowded).contradictions[0].find("fits of 20,000 keep"), std::string::npos);
  crowded.gaussians = 200'000;  // of a sample that is as large as it may be
  EXPECT_NE(Judge(estimate, crowded).contradictions[0].find("fits of 200,000 and more keep"), std::string::npos);
  crowded.gaussians = 3000;  // a thin thing in few pixels keeps as many
  crowded.spacing = 0.007;
  EXPECT_FALSE(Judge(estimate, crowded).contradicted());
  crowded.gaussians = 100'000;
  crowded.spacing = 0.0105;  // 0.9
  EXPECT_TRUE(Judge(estimate, crowded).contradicted());

  // Hardly above the bound of 2.5 on a pixel, it makes pixels a little smaller; far above it, harmless.
  crowded = plain;
  crowded.harmless = 0.0007;
  crowded.spacing = 0.01 / std::sqrt(2.5 * 1.001);
  EXPECT_LT(Judge(estimate, crowded).size, 0.01);
  EXPECT_GT(Judge(estimate, crowded).size, 0.0099);
  crowded.spacing = 0.01 / std::sqrt(2.5 * 1.25);
  EXPECT_NEAR(Judge(estimate, crowded).size, 0.01 / 2.4414, 1e-5);
  crowded.spacing = 0.01 / std::sqrt(2.5 * 10.0);
  EXPECT_DOUBLE_EQ(Judge(estimate, crowded).size, 0.0007);
  crowded.spacing = 0.01 / std::sqrt(2.5 * 1.25);
  crowded.without_black = 0.005;  // more than one thing speaks against it, and nothing against this
  EXPECT_DOUBLE_EQ(Judge(estimate, crowded).size, 0.005);
  crowded.spacing = 0.005 / std::sqrt(2.5 * 1.01);  // crowded without the black ones, too
  EXPECT_DOUBLE_EQ(Judge(estimate, crowded).size, 0.0007);

  // In layers of wide ones there are more, and no more detail for that.
  crowded = plain;
  crowded.spacing = 0.005;  // four on a pixel
  EXPECT_TRUE(Judge(estimate, crowded).contradicted());
  crowded.footprint = 0.007;  // two
  EXPECT_FALSE(Judge(estimate, crowded).contradicted());
  crowded.footprint = 0.006;
  ASSERT_TRUE(Judge(estimate, crowded).contradicted());
  EXPECT_NE(Judge(estimate, crowded).contradictions[0].find("2.8 Gaussians beside each other"), std::string::npos);

  // Where most of them show, there are half as many.
  crowded = plain;
  crowded.spacing = 0.01 / std::sqrt(2.3);
  EXPECT_FALSE(Judge(estimate, crowded).contradicted());
  estimate.showing = 0.8;
  EXPECT_TRUE(Judge(estimate, crowded).contradicted());
  EXPECT_LT(Judge(estimate, crowded).size, 0.01 / 3);
  crowded.spacing = 0.01 / std::sqrt(1.2);
  EXPECT_FALSE(Judge(estimate, crowded).contradicted());
  estimate.showing = 0.3;

  // As soft as few Gaussians are far apart.
  PixelSizeEvidence few = plain;
  few.all = 1000;
  EXPECT_TRUE(Judge(estimate, few).contradicted());
  EXPECT_NEAR(Judge(estimate, few).size, 0.01 / std::pow(4, 0.75), 1e-5);
  few.all = 2400;
  EXPECT_FALSE(Judge(estimate, few).contradicted());
  EXPECT_LT(Judge(estimate, few).size, 0.01);

  PixelSizeEvidence small = plain;
  small.small_axis = 0.001;
  EXPECT_TRUE(Judge(estimate, small).contradicted());
  EXPECT_DOUBLE_EQ(Judge(estimate, small).size, plain.harmless);
  small.small_axis = 0.0035;
  EXPECT_FALSE(Judge(estimate, small).contradicted());
  EXPECT_NEAR(Judge(estimate, small).size, 0.01 * std::pow(0.35 / 0.4, 4), 1e-9);
  small.small_axis = 0.0041;
  EXPECT_DOUBLE_EQ(Judge(estimate, small).size, 0.01);
  small.small_axis = 0.001;
  PixelSizeEstimate any = estimate;
  any.high = 11 * any.low;
  ASSERT_EQ(Judge(any, plain).contradictions.size(), 1u);
  EXPECT_NE(Judge(any, plain).contradictions[0].find("as good as no estimate"), std::string::npos);

  PixelSizeEvidence black = plain;
  black.without_black = 0.005;
  const PixelSizeFinding finding = Judge(estimate, black);
  ASSERT_EQ(finding.contradictions.size(), 1u);
  EXPECT_EQ(finding.size, 0.005);
  black.small_axis = 0.0005;  // a tenth of that
  EXPECT_LT(Judge(estimate, black).size, 0.004);
  black.small_axis = plain.small_axis;
  black.without_black = 0.02;  // the estimate is the smaller one: it cannot blur
  EXPECT_FALSE(Judge(estimate, black).contradicted());

  PixelSizeEvidence balls = plain;
  balls.roundness = 0.95;
  ASSERT_TRUE(Judge(estimate, balls).contradicted());
  EXPECT_NE(Judge(estimate, balls).contradictions[0].find("balls"), std::string::npos);
  EXPECT_DOUBLE_EQ(Judge(estimate, balls).size, plain.harmless);
  balls.roundness = 0.85;
  EXPECT_FALSE(Judge(estimate, balls).contradicted());

  // Gaussians that come of smaller pixels: what the outlines say without black ones is no size for all, either.
  PixelSizeEvidence uneven = plain;
  uneven.unevenness = 2.7 * std::sqrt(2);
  EXPECT_TRUE(Judge(estimate, uneven).no_one_pixel);
  EXPECT_DOUBLE_EQ(Judge(estimate, uneven).size, plain.harmless);
  EXPECT_DOUBLE_EQ(Judge(estimate, uneven).least, 0.0025);
  uneven.without_black = 0.006;
  EXPECT_EQ(Judge(estimate, uneven).least, 0);
  EXPECT_DOUBLE_EQ(Judge(estimate, uneven).size, plain.harmless);
  uneven.without_black = 0;
  uneven.unevenness = 4;  // regions may bear more
  EXPECT_DOUBLE_EQ(Judge(estimate, uneven).size, plain.harmless);
  EXPECT_LT(Judge(estimate, uneven).least, 0.0022);
  uneven.dense = 0.0076;  // of a pixel of 0.01: few Gaussians where there is little to see
  EXPECT_FALSE(Judge(estimate, uneven).contradicted());
  EXPECT_FALSE(Judge(estimate, uneven).no_one_pixel);
  EXPECT_TRUE(Judge(estimate, uneven).is_one());
  EXPECT_NEAR(Judge(estimate, uneven).size, 0.0076 / 0.85, 1e-9);
  uneven.dense = 0.02;
  EXPECT_DOUBLE_EQ(Judge(estimate, uneven).size, estimate.size);
  uneven.growth = 1.7;  // larger ones where they lie apart: of larger pixels
  EXPECT_TRUE(Judge(estimate, uneven).no_one_pixel);
  uneven.growth = 1;
  uneven.dense = 0.0074;
  EXPECT_TRUE(Judge(estimate, uneven).no_one_pixel);
  uneven.dense = 0;
  uneven.unevenness = 2.8;  // of single objects, too
  EXPECT_FALSE(Judge(estimate, uneven).contradicted());
  EXPECT_TRUE(Judge(estimate, uneven).is_one());
  EXPECT_NEAR(Judge(estimate, uneven).size, 0.0086, 1e-4);
  uneven.unevenness = std::numeric_limits<double>::infinity();
  ASSERT_TRUE(Judge(estimate, uneven).contradicted());
  EXPECT_NE(Judge(estimate, uneven).contradictions[0].find("at one place"), std::string::npos);
  uneven.unevenness = 2.6;
  EXPECT_FALSE(Judge(estimate, uneven).no_one_pixel);
  PixelSizeEstimate of_cuts = estimate;
  of_cuts.coarse_outlines = 0.95;
  ASSERT_TRUE(Judge(of_cuts, plain).contradicted());
  EXPECT_NE(Judge(of_cuts, plain).contradictions[0].find("95 % of its outlines are of Gaussians that are much coarser"),
            std::string::npos);
  of_cuts.coarse_outlines = 0.8;
  EXPECT_FALSE(Judge(of_cuts, plain).contradicted());
  EXPECT_FALSE(Judge(of_cuts, plain).part) << "coarse Gaussians are no cuts";
  of_cuts.coarse_outlines = 0;
  of_cuts.cut_outlines = 0.95;
  black.without_black = 0.005;
  EXPECT_EQ(Judge(of_cuts, black).least, 0) << "nor is it where the outlines are cuts";
  EXPECT_TRUE(Judge(estimate, plain).is_one());
  PixelSizeEvidence closer = plain;
  closer.of_many = 0.02;
  closer.closest = 0.008;
  EXPECT_FALSE(Judge(estimate, closer).contradicted());
  EXPECT_FALSE(Judge(estimate, closer).is_one());
  EXPECT_DOUBLE_EQ(Judge(estimate, closer).closer, 0.009);
  closer.closest = 0.0091;
  EXPECT_TRUE(Judge(estimate, closer).is_one());

  // Never larger than what was estimated.
  small.harmless = 1;
  EXPECT_EQ(Judge(estimate, small).size, 0.01);
}

TEST(PixelSizeGuard, FollowsTheScaleOfTheCloud) {
  GaussianCloud cloud = Example("biplane");
  const auto evidence = GatherPixelSizeEvidence(cloud);
  for (float& x : cloud.means) x *= 1000;
  for (float& x : cloud.log_scales) x += std::log(1000.0f);
  const auto large = GatherPixelSizeEvidence(cloud);
  ASSERT_TRUE(evidence.ok() && large.ok());
  EXPECT_EQ(evidence->gaussians, large->gaussians);
  EXPECT_NEAR(large->spacing / evidence->spacing, 1000, 1);
  EXPECT_NEAR(large->harmless / evidence->harmless, 1000, 1);
  EXPECT_NEAR(large->small_axis / evidence->small_axis, 1000, 1);
  EXPECT_NEAR(large->flatness, evidence->flatness, 1e-3);
}

}  // namespace
}  // namespace anchorsplat
