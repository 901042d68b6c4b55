#include "reading/places.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>
#include <vector>

#include "core/parallel.h"
#include "core/random.h"
#include "core/source_dir_for_test.h"
#include "core/statistics.h"
#include "formats/cloud_io.h"
#include "reading/reading_model.h"

namespace anchorsplat {
namespace {

GaussianCloud Biplane() { return *ReadCloud(SourceDirForTest() / "examples/biplane/input.ply"); }

// The same subject once more behind it, seen from so many times farther away.
GaussianCloud WithAFarOne(float times) {
  GaussianCloud both = Biplane(), far = both;
  for (float& x : far.means) x = times * x;
  for (size_t i = 0; i < far.means.size(); i += 3) far.means[i] += 2 * times;
  for (float& x : far.log_scales) x += std::log(times);
  EXPECT_TRUE(Append(both, far).ok());
  return both;
}

double MedianOf(const Buffer<float>& values, int64_t first, int64_t last) {
  Buffer<float> part(values.begin() + first, values.begin() + last);
  return double{Quantile(part, 0.5)};
}

TEST(Places, ShareWhatShows) {
  const GaussianCloud cloud = Biplane();
  const SplatPlaces places(cloud);
  ASSERT_GT(places.count(), 4);
  std::set<int64_t> all;
  int64_t count = 0, least = cloud.size(), most = 0;
  for (int64_t k = 0; k < places.count(); ++k) {
    all.insert(places.rows(k).begin(), places.rows(k).end());
    count += std::ssize(places.rows(k));
    least = std::min(least, std::ssize(places.rows(k)));
    most = std::max(most, std::ssize(places.rows(k)));
  }
  EXPECT_GE(least, 999);
  EXPECT_LE(most - least, 1);
  EXPECT_EQ(std::ssize(all), count) << "none is in two";
}

TEST(Places, SpreadTheirValuesWithoutSteps) {
  const GaussianCloud cloud = Biplane();
  const SplatPlaces places(cloud);
  std::vector<double> values(static_cast<size_t>(places.count()));
  std::iota(values.begin(), values.end(), 0.0);
  const Buffer<float> spread = places.Spread(values, cloud.means);
  ASSERT_EQ(std::ssize(spread), cloud.size());
  int64_t own = 0, all = 0;
  for (int64_t k = 0; k < places.count(); ++k) {
    for (const int64_t row : places.rows(k)) {
      own += std::abs(spread[static_cast<size_t>(row)] - static_cast<float>(k)) < 0.01f ? 1 : 0;
      ++all;
    }
  }
  EXPECT_GT(own, all / 2) << "inside of a place all around are of it";
  EXPECT_LT(own, all) << "at its border they are not";
}

TEST(Places, FarThingsHaveLargerPixels) {
  const GaussianCloud cloud = WithAFarOne(20);
  const Buffer<float> ratios = PixelRatios(cloud, ReadingModel::Shipped());
  ASSERT_EQ(std::ssize(ratios), cloud.size());
  const double near = MedianOf(ratios, 0, cloud.size() / 2), far = MedianOf(ratios, cloud.size() / 2, cloud.size());
  EXPECT_NEAR(std::log(far / near), std::log(20.0), 0.25);
}

TEST(Places, OfOneDistanceHaveOnePixel) { EXPECT_TRUE(PixelRatios(Biplane(), ReadingModel::Shipped()).empty()); }

TEST(Places, AreTheSameForAnyNumberOfThreads) {
  const GaussianCloud cloud = WithAFarOne(5);
  SetThreadCount(1);
  const Buffer<float> one = PixelRatios(cloud, ReadingModel::Shipped());
  SetThreadCount(3);
  const Buffer<float> three = PixelRatios(cloud, ReadingModel::Shipped());
  SetThreadCount(0);
  EXPECT_FALSE(one.empty());
  EXPECT_EQ(one, three);
}

// More than the tree is made of: it has every so many, the places have all that lie there.
GaussianCloud Many(int64_t count, float side) {
  Random random(1);
  GaussianCloud cloud;
  cloud.Resize(count, 0);
  std::ranges::fill(cloud.quats, 0.5f);
  std::ranges::fill(cloud.opacity_logits, 3.0f);
  for (float& x : cloud.means) x = side * static_cast<float>(random.Uniform());
  return cloud;
}

TEST(Places, OfManyHaveAllThatLiesThere) {
  const GaussianCloud cloud = Many(600'000, 1);
  const SplatPlaces places(cloud);
  ASSERT_EQ(places.count(), 64);
  for (int64_t k = 0; k < places.count(); ++k) {
    const std::vector<int64_t>& rows = places.rows(k);
    ASSERT_GT(std::ssize(rows), 1500) << k;
    ASSERT_LT(std::ssize(rows), 5000) << k;
    std::array<float, 3> low, high;
    low.fill(1), high.fill(0);
    for (const int64_t row : rows) {
      for (size_t a = 0; a < 3; ++a) {
        low[a] = std::min(low[a], cloud.means[static_cast<size_t>(3 * row) + a]);
        high[a] = std::max(high[a], cloud.means[static_cast<size_t>(3 * row) + a]);
      }
    }
    const double volume = double{high[0] - low[0]} * (high[1] - low[1]) * (high[2] - low[2]);
    EXPECT_NEAR(static_cast<double>(rows.size()) / (600'000 * volume), 1, 0.1) << "as dense as the splat";
  }
}

TEST(Places, OfManyInOnePointAreBounded) {
  const SplatPlaces places(Many(600'000, 0));
  int64_t rows = 0;
  for (int64_t k = 0; k < places.count(); ++k) rows += std::ssize(places.rows(k));
  EXPECT_GT(rows, 0);
  EXPECT_LE(rows, 64 * 8000);
}

TEST(Places, OfLittleAndOfWhatIsNotFinite) {
  EXPECT_TRUE(PixelRatios(GaussianCloud{}, ReadingModel::Shipped()).empty());
  GaussianCloud cloud = WithAFarOne(20);
  const SplatPlaces before(cloud);
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  for (size_t i = 0; i < 300; ++i) cloud.means[30 * i] = kNaN;
  const SplatPlaces places(cloud);
  EXPECT_LE(places.count(), before.count());
  for (int64_t k = 0; k < places.count(); ++k) {
    for (const int64_t row : places.rows(k)) EXPECT_TRUE(IsUsable(cloud, row));
  }
}

}  // namespace
}  // namespace anchorsplat
