#include "reading/reading.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "core/random.h"
#include "core/simd_targets_for_test.h"
#include "core/source_dir_for_test.h"
#include "formats/cloud_io.h"
#include "reading/treatment.h"

namespace anchorsplat {
namespace {

constexpr double kTrue = 0.0055013;  // training pixel of the examples: 1.7 / 309.02

GaussianCloud Example(const std::string& name) {
  return ReadCloud(SourceDirForTest() / "examples" / name / "input.ply").value();
}

TEST(Reading, OfFitsIsNearTheTruth) {
  for (const char* name : {"biplane", "stone_lantern"}) {
    const auto reading = Read(Example(name));
    ASSERT_TRUE(reading.ok()) << reading.error().message;
    EXPECT_GT(reading->pixel, 0.75 * kTrue) << name;
    EXPECT_LT(reading->pixel, 1.25 * kTrue) << name;
    EXPECT_EQ(reading->likeliest(), Provenance::kClassic) << name;
    EXPECT_LT(reading->low, reading->pixel);
    EXPECT_GT(reading->high, reading->pixel);
    EXPECT_LT(reading->strangeness, 1) << name;
    double sum = 0;
    for (const double probability : reading->provenance) sum += probability;
    EXPECT_NEAR(sum, 1, 1e-6);
    EXPECT_EQ(Treat(*reading, {}).method, TreatmentMethod::kNetwork) << name;
  }
}

TEST(Reading, FollowsTheScaleOfTheSplat) {
  const GaussianCloud cloud = Example("biplane");
  const auto reading = Read(cloud);
  ASSERT_TRUE(reading.ok());
  for (const float factor : {1e-4f, 1e4f}) {
    GaussianCloud scaled = cloud;
    for (float& x : scaled.means) x *= factor;
    for (float& x : scaled.log_scales) x += std::log(factor);
    const auto other = Read(scaled);
    ASSERT_TRUE(other.ok());
    EXPECT_NEAR(other->pixel / reading->pixel / double{factor}, 1, 0.02) << factor;
    EXPECT_NEAR(other->high / other->low, reading->high / reading->low, 0.05) << factor;
  }
}

TEST(LikeliestShrink, WeighsThePictureSizeAtHandAgainstWhatTheSplatShows) {
  Reading reading;
  reading.unit = 2;
  reading.predictions.resize(1);
  const auto shrink = [&](double pixel, double seen, double spread) {
    reading.predictions[0].log_pixel = std::log(seen / reading.unit);
    reading.predictions[0].log_spread = std::log(spread);
    return LikeliestShrink(reading, pixel);
  };
  EXPECT_EQ(shrink(0.01, 0.01, 0.2), 1);
  EXPECT_EQ(shrink(0.01, 0.02, 0.2), 0.5);
  EXPECT_EQ(shrink(0.01, 0.04, 0.2), 0.25);
  EXPECT_EQ(shrink(0.01, 0.03, 2), 1);     // not known well
  EXPECT_EQ(shrink(0.01, 0.001, 0.2), 1);  // pictures are not enlarged
  const std::array<double, 2> wider = {1, 2};
  EXPECT_EQ(LikeliestShrink(reading, 0.01, wider), 2);
}

TEST(Reading, GoesByTheMoreCertainOfTheWholeAndItsPlaces) {
  const ReadingModel& model = ReadingModel::Shipped();
  SplatFeatures whole = FeaturesOf(Example("biplane")).value();
  ASSERT_GT(whole.places.size(), 2);
  whole.places.clear();
  const Reading alone = ReadFrom(whole, model);
  SplatFeatures same = whole;
  whole.places = {same, same, same};
  EXPECT_NEAR(ReadFrom(whole, model).pixel, alone.pixel, 1e-4 * alone.pixel) << "they say the same";
  for (SplatFeatures& place : whole.places) place.unit *= 4;  // as certain as the whole
  const Reading between = ReadFrom(whole, model);
  EXPECT_NEAR(between.pixel, 2 * alone.pixel, 1e-3 * alone.pixel);
  EXPECT_NEAR(std::exp(between.predictions.front().log_spread),
              std::hypot(std::exp(alone.predictions.front().log_spread), std::log(2)), 1e-4);
  whole.places.resize(1);
  EXPECT_EQ(ReadFrom(whole, model).pixel, alone.pixel) << "one place is the whole";
}

// AVX2, AVX-512 and what a page runs on: the pixels that are drawn differ by rounding alone.
TEST(Reading, LeadsToTheSameTreatmentOnEveryProcessor) {
  for (const char* name : {"biplane", "stone_lantern", "tankard"}) {
    const GaussianCloud cloud = Example(name);
    const Treatment best = Treat(Read(cloud).value(), {});
    ForEachSimdTarget([&] {
      const Treatment treatment = Treat(Read(cloud).value(), {});
      EXPECT_EQ(treatment.method, best.method) << name;
      EXPECT_EQ(treatment.mode, best.mode) << name;
      EXPECT_NEAR(treatment.pixel, best.pixel, 1e-4 * best.pixel) << name;
    });
  }
  SkipWhenOnlyOneSimdTarget();
}

// But for what SPZ clamps: lengths below 4e-5, of which the tankard has thousands.
TEST(Reading, LeadsToTheSameTreatmentAfterSpz) {
  for (const char* name : {"biplane", "stone_lantern"}) {
    const GaussianCloud cloud = Example(name);
    const std::string file = testing::TempDir() + "reading-" + name + ".spz";
    ASSERT_TRUE(WriteCloud(file, cloud, {.overwrite = true}).ok());
    const auto back = ReadCloud(file);
    ASSERT_TRUE(back.ok()) << back.error().message;
    const Treatment before = Treat(Read(cloud).value(), {}), after = Treat(Read(*back).value(), {});
    EXPECT_EQ(after.method, before.method) << name;
    EXPECT_EQ(after.mode, before.mode) << name;
    EXPECT_NEAR(std::log2(after.pixel / before.pixel), 0, 0.26) << name;  // no more than one of those that are tried
  }
}

// What captures of real places have behind their subject must not decide.
TEST(Reading, IsNotMovedByGiantsAndSkies) {
  const GaussianCloud example = Example("biplane");
  const double plain = Read(example)->pixel;
  struct Addition {
    int count;
    float log_scale, distance;
  };
  for (const Addition added : {Addition{1, 3, 50}, {1, 5, 0}, {200, 1.5f, 20}, {3, 80, 1}, {100, 0, 8}}) {
    GaussianCloud cloud = example;
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
    const auto reading = Read(cloud);
    ASSERT_TRUE(reading.ok()) << reading.error().message;
    EXPECT_NEAR(reading->pixel / plain, 1, 0.15) << added.count << " of ln scale " << added.log_scale;
  }
}

TEST(Reading, AccusesOnlyWithCertainty) {
  Reading reading;
  const auto set = [&](Provenance made, double probability) {
    reading.provenance[static_cast<size_t>(made)] = probability;
  };
  set(Provenance::kEnhanced, 0.6);
  set(Provenance::kClassic, 0.3);
  set(Provenance::kGenerated, 0.1);
  EXPECT_EQ(reading.likeliest(), Provenance::kClassic);
  // Several that have their width are as good as one.
  set(Provenance::kEnhanced, 0.5);
  set(Provenance::kMip, 0.45);
  set(Provenance::kClassic, 0.05);
  set(Provenance::kGenerated, 0);
  EXPECT_EQ(reading.likeliest(), Provenance::kEnhanced);
}

TEST(Reading, NeedsSomethingThatShows) {
  EXPECT_FALSE(Read(GaussianCloud()).ok());
  GaussianCloud invisible = Example("biplane");
  for (float& logit : invisible.opacity_logits) logit = -8;
  EXPECT_FALSE(Read(invisible).ok());
}

}  // namespace
}  // namespace anchorsplat
