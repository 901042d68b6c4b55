#include "enhance/trained_kind.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "core/random.h"
#include "core/source_dir_for_test.h"
#include "enhance/enhance.h"
#include "enhance/filter.h"
#include "enhance/network_for_test.h"
#include "enhance/showing_gaussians.h"
#include "formats/cloud_io.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

constexpr double kPixel = 0.0055;  // of both examples, nearly

SizeTails FindSizeTails(const GaussianCloud& cloud) { return SizeTailsOf(FindShowingGaussians(cloud).all); }

std::optional<TrainedKind> FindTrainedKind(const GaussianCloud& cloud) {
  return TrainedKindOf(cloud, FindShowingGaussians(cloud));
}

GaussianCloud Example(const char* object) {
  auto cloud = ReadCloud(SourceDirForTest() / "examples" / object / "input.ply");
  EXPECT_TRUE(cloud.ok());
  return cloud.ok() ? *std::move(cloud) : GaussianCloud{};
}

GaussianCloud Grey(int64_t n) {
  GaussianCloud cloud;
  cloud.Resize(n, 0);
  std::ranges::fill(cloud.sh, 0.0f);
  std::ranges::fill(cloud.means, 0.0f);
  std::ranges::fill(cloud.quats, 0.5f);
  std::ranges::fill(cloud.opacity_logits, 1.0f);
  return cloud;
}

// Gaussians of any colour and direction, of axes whose logarithms are normal, those that are thinner than `least` along
// the two smaller axes taken out, as an antialiased rasterizer makes them invisible, and `widened` by that much along
// all axes.
GaussianCloud Made(double least, double widened, int64_t n = 8000, uint64_t seed = 3) {
  GaussianCloud cloud = Grey(n);
  Random random(seed), opacities(seed + 1);
  for (float& logit : cloud.opacity_logits) logit = static_cast<float>(1 + 1.5 * opacities.Normal());
  for (size_t i = 0; i < static_cast<size_t>(n); ++i) {
    std::array<double, 3> axes;
    do {
      for (double& axis : axes) axis = std::exp(2 * std::min(0.0, random.Normal()));
      std::sort(axes.begin(), axes.end());
    } while (axes[1] < least * random.Uniform(0.9, 1.1));
    for (size_t a = 0; a < 3; ++a) {
      cloud.means[3 * i + a] = static_cast<float>(random.Normal());
      cloud.log_scales[3 * i + a] = static_cast<float>(std::log(std::hypot(axes[a], widened)) - 5);
      cloud.sh[3 * i + a] = static_cast<float>(random.Normal());
    }
    for (size_t a = 0; a < 4; ++a) cloud.quats[4 * i + a] = static_cast<float>(random.Normal());
  }
  return cloud;
}

TEST(TrainedKind, TailsAreTheMeanDistanceToTheirQuantiles) {
  // ln of the smallest axis is −0.01 k, of the middle one −0.005 k, k = 0 … 999.
  GaussianCloud cloud = Grey(1000);
  for (size_t k = 0; k < 1000; ++k) {
    const auto x = static_cast<float>(k);
    cloud.means[3 * k] = 1e-3f * x;
    cloud.log_scales[3 * k] = 1;
    cloud.log_scales[3 * k + 1] = -0.005f * x;
    cloud.log_scales[3 * k + 2] = -0.01f * x;
  }
  const SizeTails tails = FindSizeTails(cloud);
  EXPECT_EQ(tails.gaussians, 1000);
  // Quantiles lie at 19.98 and 49.95 steps from the smallest; below them are 20 and 50, 9.5 and 24.5 away in the mean.
  const double steps = std::sqrt((19.98 - 9.5) * (49.95 - 24.5));
  EXPECT_EQ(tails.opaque, 0);
  EXPECT_NEAR(tails.middle, 0.005 * steps, 1e-5);
  EXPECT_NEAR(tails.smallest, 0.01 * steps, 1e-5);
  EXPECT_NEAR(tails.roundness, std::exp((0.005 - 0.01) * 949), 1e-3);
}

TEST(TrainedKind, ExamplesAreClassic) {
  for (const char* object : {"biplane", "stone_lantern", "tankard"}) {
    EXPECT_EQ(FindTrainedKind(Example(object)), TrainedKind::kClassic) << object;
  }
}

TEST(TrainedKind, WhatIsThinnerThanAPixelIsMissingInAntialiasedFits) {
  EXPECT_EQ(FindTrainedKind(Made(0, 0)), TrainedKind::kClassic) << FindSizeTails(Made(0, 0)).middle;
  EXPECT_EQ(FindTrainedKind(Made(0.3, 0)), TrainedKind::kAntialiased) << FindSizeTails(Made(0.3, 0)).middle;
  EXPECT_EQ(FindTrainedKind(Made(0, 0.3)), TrainedKind::kWidened) << FindSizeTails(Made(0, 0.3)).smallest;
}

TEST(TrainedKind, DoesNotDependOnTheUnit) {
  GaussianCloud cloud = Made(0.3, 0);
  const SizeTails one = FindSizeTails(cloud);
  for (float& x : cloud.means) x *= 1000;
  for (float& s : cloud.log_scales) s += std::log(1000.0f);
  const SizeTails other = FindSizeTails(cloud);
  EXPECT_NEAR(one.middle, other.middle, 1e-4);
  EXPECT_NEAR(one.smallest, other.smallest, 1e-4);
  EXPECT_EQ(one.gaussians, other.gaussians);
}

TEST(TrainedKind, WhatHasBeenFilteredHasItsWidth) {
  GaussianCloud cloud = Example("biplane");
  ASSERT_TRUE(ApplyFilter(cloud, std::vector<float>{static_cast<float>(kPixel)}, {}).ok());
  EXPECT_EQ(FindTrainedKind(cloud), TrainedKind::kWidened);
}

// Formats keep sizes in steps, and say nothing of how a splat was trained.
TEST(TrainedKind, DoesNotDependOnTheFormat) {
  const TestFolder folder;
  for (const GaussianCloud& cloud : {Example("biplane"), Made(0, 0), Made(0.3, 0), Made(0, 0.3)}) {
    const auto kind = FindTrainedKind(cloud);
    const double tail = FindSizeTails(cloud).middle;
    for (const char* name : {"a.spz", "a.sog", "a.splat", "a.compressed.ply"}) {
      ASSERT_TRUE(WriteCloud(folder / name, cloud, {.overwrite = true}).ok()) << name;
      const auto read = ReadCloud(folder / name);
      ASSERT_TRUE(read.ok()) << name;
      EXPECT_EQ(FindTrainedKind(*read), kind) << name;
      if (tail < 0.9) {  // SPZ ends at exp(−10)
        EXPECT_NEAR(FindSizeTails(*read).middle, tail, 0.05) << name;
      }
    }
  }
}

// SPZ ends sizes at e^−10: the thinnest of a splat of a small unit all have that one, like those of a widened splat.
TEST(TrainedKind, WhatAFormatCutOffIsNoWidth) {
  for (const double share : {0.015, 0.03, 0.1}) {
    for (const auto& [made, kind] :
         {std::pair(Example("biplane"), TrainedKind::kClassic), std::pair(Made(0, 0), TrainedKind::kClassic),
          std::pair(Made(0.3, 0), TrainedKind::kAntialiased), std::pair(Made(0, 0.3), TrainedKind::kWidened)}) {
      GaussianCloud cloud = made;
      std::vector<float> smallest;
      for (size_t i = 0; i < cloud.log_scales.size(); i += 3) {
        smallest.push_back(std::min({cloud.log_scales[i], cloud.log_scales[i + 1], cloud.log_scales[i + 2]}));
      }
      const auto at = smallest.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(smallest.size()));
      std::nth_element(smallest.begin(), at, smallest.end());
      const float shift = -10 - *at;
      for (float& x : cloud.means) x *= std::exp(shift);
      for (float& s : cloud.log_scales) s = std::max(-10.0f, std::round(16 * (s + shift)) / 16);
      const SizeTails tails = FindSizeTails(cloud);
      EXPECT_EQ(FindTrainedKind(cloud), kind) << share << ' ' << tails.smallest << ' ' << tails.middle;
    }
  }
}

TEST(TrainedKind, FlatGaussiansAreNotWidened) {
  for (const float flat : {-20.0f, -std::numeric_limits<float>::infinity()}) {
    GaussianCloud cloud = Made(0, 0);
    for (size_t i = 0; i < cloud.log_scales.size(); i += std::isinf(flat) ? 30 : 3) {
      *std::min_element(cloud.log_scales.begin() + static_cast<std::ptrdiff_t>(i),
                        cloud.log_scales.begin() + static_cast<std::ptrdiff_t>(i) + 3) = flat;
    }
    EXPECT_EQ(FindTrainedKind(cloud), TrainedKind::kClassic) << flat;
  }
}

// Converters of meshes make Gaussians all alike, and who throws faint ones away leaves opaque ones among the thinnest.
TEST(TrainedKind, WhatNoTrainingLeavesIsUnclear) {
  SizeTails tails{.gaussians = 5000, .middle = 0.2, .smallest = 0.8, .roundness = 0.2, .opaque = 0, .faint = 0.1};
  EXPECT_EQ(Judge(tails), TrainedKind::kAntialiased);
  tails.faint = 0;
  EXPECT_EQ(Judge(tails), TrainedKind::kUnclear);
  tails.middle = 0.9;
  EXPECT_EQ(Judge(tails), TrainedKind::kClassic);
  GaussianCloud alike = Made(0.3, 0);
  for (size_t i = 0; i < alike.log_scales.size(); ++i) alike.log_scales[i] = i % 3 == 0 ? -9.0f : -4.0f;
  EXPECT_EQ(FindTrainedKind(alike), TrainedKind::kUnclear);
  // As they are, and without those below 0.3.
  GaussianCloud pruned = Made(0.3, 0);
  EXPECT_EQ(FindTrainedKind(pruned), TrainedKind::kAntialiased);
  for (float& logit : pruned.opacity_logits) logit = logit < -0.8473f ? -20.0f : logit;
  EXPECT_EQ(FindTrainedKind(pruned), TrainedKind::kUnclear);
}

// Opacities that somebody raised make all Gaussians wider than they were trained. Without the faint ones a splat only
// has fewer.
TEST(TrainedKind, RaisedOpacitiesAreSeen) {
  const GaussianCloud trained = Example("stone_lantern");
  const auto changed = [&](auto&& change) {
    GaussianCloud cloud = trained;
    for (float& logit : cloud.opacity_logits) logit = change(logit);
    return FindTrainedKind(cloud);
  };
  EXPECT_EQ(changed([](float x) { return x; }), TrainedKind::kClassic);
  EXPECT_EQ(changed([](float) { return 20.0f; }), TrainedKind::kRaised);
  EXPECT_EQ(changed([](float x) { return x + 3; }), TrainedKind::kRaised);
  EXPECT_EQ(changed([](float x) { return std::max(x, 2.0f); }), TrainedKind::kRaised);
  EXPECT_EQ(changed([](float x) { return x + 0.5f; }), TrainedKind::kClassic);
  EXPECT_EQ(changed([](float x) { return x < -0.85f ? -20.0f : x; }), TrainedKind::kClassic) << "pruned";
  EXPECT_EQ(changed([](float x) { return x < 1.0f ? -20.0f : x; }), TrainedKind::kClassic) << "pruned";
  // Whatever the tag, but for that of Mip-Splatting, which has all its width anyway.
  EXPECT_EQ(BesideTag(TrainedKind::kRaised, RenderMode::kClassic, 5000), TrainedKind::kRaised);
  EXPECT_EQ(BesideTag(TrainedKind::kRaised, RenderMode::kAntialiased, 500), TrainedKind::kRaised);
  EXPECT_EQ(BesideTag(TrainedKind::kRaised, {}, 5000), TrainedKind::kRaised);
  EXPECT_EQ(BesideTag(TrainedKind::kRaised, RenderMode::kMip, 5000), std::nullopt);
}

// SPZ has no lengths below e^−10: of the examples it cuts off a tenth and more of the smallest axes.
TEST(TrainedKind, ExamplesThroughSpzAreClassic) {
  const TestFolder folder;
  for (const char* object : {"biplane", "stone_lantern", "tankard"}) {
    GaussianCloud cloud = Example(object);
    cloud.render_mode.reset();
    ASSERT_TRUE(WriteCloud(folder / "a.spz", cloud, {.overwrite = true}).ok());
    const auto read = ReadCloud(folder / "a.spz");
    ASSERT_TRUE(read.ok()) << read.error().message;
    EXPECT_GT(FindSizeTails(*read).cut_off, 0.05) << "a test of nothing";
    EXPECT_EQ(FindTrainedKind(*read), TrainedKind::kClassic) << object;
  }
}

TEST(TrainedKind, TooFewOrBrokenOnes) {
  EXPECT_EQ(FindTrainedKind({}), std::nullopt);
  EXPECT_EQ(FindTrainedKind(Made(0, 0.3, 150)), std::nullopt);
  EXPECT_EQ(FindTrainedKind(Made(0, 0.3, 600)), TrainedKind::kWidened);
  SizeTails few{.gaussians = 900, .middle = 0.33, .smallest = 0.8, .roundness = 0.2, .opaque = 0, .faint = 0.1};
  EXPECT_EQ(Judge(few), TrainedKind::kUnclear);
  few.gaussians = 2000;
  EXPECT_EQ(Judge(few), TrainedKind::kClassic);
  few.middle = 0.24;
  EXPECT_EQ(Judge(few), TrainedKind::kAntialiased);
  GaussianCloud cloud = Made(0.3, 0);
  for (size_t i = 0; i < cloud.log_scales.size(); i += 30) cloud.log_scales[i] = std::nanf("");
  EXPECT_EQ(FindTrainedKind(cloud), TrainedKind::kAntialiased);
  for (float& s : cloud.log_scales) s = 1;
  EXPECT_EQ(FindTrainedKind(cloud), TrainedKind::kWidened);
}

TEST(TrainedKind, ATagIsDoubtedOnlyWhereThereIsAWidth) {
  for (const TrainedKind kind : {TrainedKind::kWidened, TrainedKind::kEnhanced}) {
    EXPECT_EQ(BesideTag(kind, {}, 500), kind);
    EXPECT_EQ(BesideTag(kind, RenderMode::kAntialiased, 500), kind);
    EXPECT_EQ(BesideTag(kind, RenderMode::kClassic, 5000), kind);
    EXPECT_EQ(BesideTag(kind, RenderMode::kClassic, 500), std::nullopt) << "few large ones look so";
    EXPECT_EQ(BesideTag(kind, RenderMode::kMip, 5000), std::nullopt);
  }
  EXPECT_EQ(BesideTag(TrainedKind::kAntialiased, RenderMode::kClassic, 5000), std::nullopt);
  EXPECT_EQ(BesideTag(TrainedKind::kUnclear, {}, 5000), TrainedKind::kUnclear);
}

// What `enhance` makes of it, and that whoever says a mode is believed.
TEST(TrainedKind, EnhanceActsOnIt) {
  EnhanceOptions options;
  options.method = "filter";
  options.pixel_size = 0.01;
  const auto run = [&](GaussianCloud cloud) {
    auto enhanced = Enhance(std::move(cloud), options);
    EXPECT_TRUE(enhanced.ok());
    return *std::move(enhanced);
  };
  const Enhanced antialiased = run(Made(0.3, 0));
  EXPECT_EQ(antialiased.report.looks, TrainedKind::kAntialiased);
  EXPECT_EQ(antialiased.cloud.render_mode, RenderMode::kAntialiased);
  EXPECT_EQ(antialiased.report.filter_strength, DefaultFilterStrength(4, RenderMode::kAntialiased));

  const GaussianCloud wide = Made(0, 0.3);
  const Enhanced widened = run(wide);
  EXPECT_EQ(widened.report.looks, TrainedKind::kWidened);
  EXPECT_EQ(widened.cloud.log_scales, wide.log_scales);
  EXPECT_FALSE(widened.cloud.render_mode);

  const Enhanced classic = run(Made(0, 0));
  EXPECT_EQ(classic.report.looks, TrainedKind::kClassic);
  EXPECT_EQ(classic.report.filter_strength, DefaultFilterStrength(4));

  // Trainers that know no other mode tag everything classic.
  GaussianCloud said = wide;
  said.render_mode = RenderMode::kClassic;
  const Enhanced tagged = run(said);
  EXPECT_EQ(tagged.report.looks, TrainedKind::kWidened);
  EXPECT_EQ(tagged.cloud.log_scales, wide.log_scales);
  GaussianCloud right = Made(0, 0);
  right.render_mode = RenderMode::kClassic;
  EXPECT_EQ(run(right).report.filter_strength, DefaultFilterStrength(4));
  // Of a region it is the region that is looked at.
  GaussianCloud halves = Made(0, 0), other_half = wide;
  for (size_t i = 0; i < other_half.means.size(); i += 3) {
    halves.means[i] = -std::abs(halves.means[i]);
    other_half.means[i] = std::abs(other_half.means[i]);
  }
  ASSERT_TRUE(Append(halves, other_half).ok());
  halves.render_mode = RenderMode::kClassic;
  for (const double side : {-1.0, 1.0}) {
    options.region = RegionOf(std::vector<double>{0, -9, -9, 9 * side, 9, 9});
    EXPECT_EQ(run(halves).report.looks == TrainedKind::kWidened, side > 0) << side;
  }
  options.region = std::nullopt;
  // Formats without a word for Mip-Splatting tag it antialiased. What the user says is believed.
  said.render_mode = RenderMode::kAntialiased;
  const Enhanced mistagged = run(said);
  EXPECT_EQ(mistagged.report.looks, TrainedKind::kWidened);
  EXPECT_EQ(mistagged.cloud.log_scales, wide.log_scales);
  EXPECT_EQ(mistagged.cloud.render_mode, RenderMode::kAntialiased);
  GaussianCloud thin = Made(0.3, 0);
  thin.render_mode = RenderMode::kAntialiased;
  EXPECT_FALSE(run(thin).report.looks);
  options.given = {"mode"};
  EXPECT_FALSE(run(said).report.looks);
  options.given.clear();
  options.filter_strength = 0.5;
  EXPECT_FALSE(run(wide).report.looks);
}

// Antialiased fits by MCMC to land from above have tails as classic ones of few steps.
TEST(TrainedKind, OfLandSizesSayLess) {
  GaussianCloud cloud;
  double least = 0.3, tail = 0;
  for (; least > 0 && !(tail > 0.27 && tail < 0.35); least -= 0.005) {
    cloud = Made(least, 0);
    const SizeTails tails = FindSizeTails(cloud);
    tail = tails.middle * std::exp(-tails.opaque);
  }
  ASSERT_GT(least, 0) << "none has such a tail";
  EXPECT_EQ(FindTrainedKind(cloud), TrainedKind::kClassic);
  for (size_t i = 2; i < cloud.means.size(); i += 3) cloud.means[i] *= 0.02f;
  EXPECT_EQ(FindTrainedKind(cloud), TrainedKind::kUnclear);
  GaussianCloud thin = Made(0, 0);
  for (size_t i = 2; i < thin.means.size(); i += 3) thin.means[i] *= 0.02f;
  EXPECT_EQ(FindTrainedKind(thin), TrainedKind::kClassic) << "there are thinner ones than antialiased fits have";
}

// Between the kinds next to nothing can be wrong.
TEST(TrainedKind, UnclearOnesGetLittle) {
  SizeTails tails{.gaussians = 5000, .middle = 0.26, .smallest = 0.8, .roundness = 0.2, .opaque = 0, .faint = 0.1};
  EXPECT_EQ(Judge(tails), TrainedKind::kClassic);
  tails.middle = 0.24;
  EXPECT_EQ(Judge(tails), TrainedKind::kAntialiased);
  tails.roundness = 0.35;
  tails.smallest = 0.34;
  EXPECT_EQ(Judge(tails), TrainedKind::kUnclear) << "as thick as where a width was added";
  tails.middle = 0.4;
  EXPECT_EQ(Judge(tails), TrainedKind::kClassic);
  tails.smallest = 0.3;
  EXPECT_EQ(Judge(tails), TrainedKind::kUnclear);
  tails = {.gaussians = 999, .middle = 0.31, .smallest = 0.8, .roundness = 0.2, .opaque = 0, .faint = 0.1};
  EXPECT_EQ(Judge(tails), TrainedKind::kUnclear) << "few say less";
  tails.gaussians = 5000;
  tails.opaque = 0.5;
  EXPECT_EQ(Judge(tails), TrainedKind::kAntialiased) << "the thinnest are opaque";
  tails = {.gaussians = 5000, .middle = 0.6, .smallest = 0.2, .roundness = 0.5, .opaque = 0, .faint = 0.1};
  EXPECT_EQ(Judge(tails), TrainedKind::kUnclear);
  tails.roundness = 0.1;
  EXPECT_EQ(Judge(tails), TrainedKind::kClassic);
  // By a network at a third of the pixel, unless it is asked for.
  constexpr uint64_t kOnlyHere = 4713;
  RegisterNetworkForTest("network-of-kinds", kOnlyHere);
  EnhanceOptions options;
  options.seed = kOnlyHere;
  options.pixel_size = 0.01;
  const auto classic = Enhance(Made(0, 0), options);
  ASSERT_TRUE(classic.ok());
  EXPECT_EQ(classic->report.method, "network-of-kinds");
  const auto unclear = Enhance(Made(0, 0.04), options);
  ASSERT_TRUE(unclear.ok());
  EXPECT_EQ(unclear->report.looks, TrainedKind::kUnclear) << FindSizeTails(Made(0, 0.04)).smallest;
  EXPECT_EQ(unclear->report.filter_strength, DefaultFilterStrength(4, RenderMode::kAntialiased));
  EXPECT_FALSE(unclear->cloud.render_mode);
  EXPECT_EQ(unclear->report.method, "network-of-kinds");
  EXPECT_EQ(unclear->report.pixel_size_source, kCautiousPixelSize);
  EXPECT_NEAR(unclear->report.pixel_size, 0.35 * 0.01, 1e-9);
  options.method = "network-of-kinds";
  EXPECT_EQ(Enhance(Made(0, 0.04), options)->report.pixel_size, 0.01);
  options.method = "auto";
  GaussianCloud opaque = Made(0, 0);
  for (float& logit : opaque.opacity_logits) logit = std::max(logit, 2.0f);
  const auto raised = Enhance(opaque, options);
  ASSERT_TRUE(raised.ok());
  EXPECT_EQ(raised->report.looks, TrainedKind::kRaised);
  EXPECT_EQ(raised->report.method, "filter");
  EXPECT_EQ(raised->report.pixel_size_source, "given");
}

}  // namespace
}  // namespace anchorsplat
