#include "reading/treatment.h"

#include <gtest/gtest.h>

#include <cmath>

namespace anchorsplat {
namespace {

// A splat of unit 1 whose pixel is `pixel`, within about a factor of e^spread, and of which treatments gain what
// `curve` says of multiples, in dB and surely.
Reading ReadingOf(double pixel, double spread, const std::array<double, 7>& network,
                  const std::array<double, 7>& filter, Provenance made = Provenance::kClassic) {
  Reading reading;
  reading.unit = 1;
  const double interval = std::log(5.0);  // of a Laplace distribution, 80 %
  reading.pixel = pixel;
  reading.low = pixel * std::exp(-interval * spread);
  reading.high = pixel * std::exp(interval * spread);
  reading.provenance[static_cast<size_t>(made)] = 1;
  ReadingPrediction& prediction = reading.predictions.emplace_back();
  prediction.log_pixel = std::log(pixel);
  prediction.log_spread = std::log(spread);
  for (size_t k = 0; k < 7; ++k) {
    for (size_t t = 0; t < kGainCount; ++t) {
      const double of_antialiased = t < 2 ? 0 : -1;  // it is a classic one
      prediction.gains[t][k] = SquashGain((t % 2 == 1 ? network : filter)[k]) + of_antialiased;
      prediction.losses[t][k] = std::max(0.0, -prediction.gains[t][k]);
    }
  }
  return reading;
}

constexpr std::array<double, 7> kNetwork = {0.5, 1, 2, 3.5, 5, 3, -3}, kFilter = {0.4, 0.8, 1.5, 2.5, 4, 3, -1};
constexpr std::array<double, 7> kHarm = {-0.3, -0.5, -1, -2, -3, -5, -8};

TEST(Treatment, TakesTheMultipleWithTheGreatestGainWhereThePixelIsKnownWell) {
  const Treatment treatment = Treat(ReadingOf(2, 0.03, kNetwork, kFilter), {});
  EXPECT_EQ(treatment.method, TreatmentMethod::kNetwork);
  EXPECT_EQ(treatment.mode, RenderMode::kClassic);
  EXPECT_NEAR(std::log(treatment.pixel / 2), 0, 0.1);
  EXPECT_NEAR(treatment.gain, 5, 0.5);
}

TEST(Treatment, TakesASmallerPixelWhereItIsNotKnownWell) {
  const Treatment sure = Treat(ReadingOf(2, 0.03, kNetwork, kFilter), {});
  const Treatment unsure = Treat(ReadingOf(2, 0.6, kNetwork, kFilter), {});
  EXPECT_LT(unsure.pixel, 0.8 * sure.pixel);
  EXPECT_LT(unsure.gain, sure.gain);
}

TEST(Treatment, ScalesWithTheUnit) {
  Reading reading = ReadingOf(2, 0.2, kNetwork, kFilter);
  const Treatment one = Treat(reading, {});
  reading.unit *= 1000;
  EXPECT_NEAR(Treat(reading, {}).pixel, 1000 * one.pixel, 1e-9);
}

TEST(Treatment, LeavesAloneWhatItWouldHarm) {
  EXPECT_EQ(Treat(ReadingOf(2, 0.1, kHarm, kHarm, Provenance::kEnhanced), {}).method, TreatmentMethod::kNone);
  // Also where the pixel is known.
  EXPECT_EQ(Treat(ReadingOf(2, 0.1, kHarm, kHarm, Provenance::kEnhanced), {.pixel = 2}).method, TreatmentMethod::kNone);
}

TEST(Treatment, LeavesAloneWhatMayBeHarmedAsMuchAsHelped) {
  Reading reading = ReadingOf(2, 0.1, kNetwork, kFilter);
  reading.predictions.push_back(ReadingOf(2, 0.1, kHarm, kHarm).predictions[0]);
  reading.predictions.push_back(ReadingOf(2, 0.1, kHarm, kHarm).predictions[0]);
  EXPECT_EQ(Treat(reading, {}).method, TreatmentMethod::kNone);
}

TEST(Treatment, EnhancesAsTheCallerSays) {
  const Reading enhanced = ReadingOf(2, 0.1, kHarm, kHarm, Provenance::kEnhanced);
  const Treatment treatment = Treat(enhanced, {.mode = RenderMode::kClassic, .mode_is_given = true});
  EXPECT_EQ(treatment.method, TreatmentMethod::kNetwork);
  EXPECT_GT(treatment.pixel, 1);
  EXPECT_LT(treatment.pixel, 2);  // to be safe
  EXPECT_EQ(treatment.mode, RenderMode::kClassic);
}

// What the reading expects nothing of is not answered with a pixel of nothing, whatever it is taken for.
TEST(Treatment, EnhancesAsTheCallerSaysWhatLooksLikeAnything) {
  for (const Provenance made : {Provenance::kGenerated, Provenance::kMesh, Provenance::kClassic}) {
    const Reading reading = ReadingOf(2, 0.1, kHarm, kHarm, made);
    const Treatment treatment = Treat(reading, {.mode = RenderMode::kClassic, .mode_is_given = true, .network = false});
    EXPECT_EQ(treatment.method, TreatmentMethod::kFilter);
    EXPECT_DOUBLE_EQ(treatment.pixel, reading.low);
    EXPECT_EQ(treatment.gain, 0);
  }
}

TEST(Treatment, KeepsToTheMethodsAndPixelsThatAreAskedFor) {
  const Reading reading = ReadingOf(2, 0.1, kNetwork, kFilter);
  EXPECT_EQ(Treat(reading, {.network = false}).method, TreatmentMethod::kFilter);
  EXPECT_EQ(Treat(reading, {.filter = false}).method, TreatmentMethod::kNetwork);
  EXPECT_NEAR(Treat(reading, {.pixel = 1.9}).pixel, 1.9, 1e-9);
}

TEST(Treatment, BelievesTheTag) {
  Reading reading = ReadingOf(2, 0.1, kNetwork, kFilter);
  const Treatment treatment = Treat(reading, {.mode = RenderMode::kAntialiased});
  EXPECT_EQ(treatment.mode, RenderMode::kAntialiased);
  EXPECT_LT(treatment.gain, 4.5);  // that of its own curve
}

}  // namespace
}  // namespace anchorsplat
