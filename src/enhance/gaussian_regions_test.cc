#include "enhance/gaussian_regions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "core/random.h"

namespace anchorsplat {
namespace {

GaussianCloud RandomCloud(int64_t count) {
  GaussianCloud cloud;
  cloud.Resize(count, 0);
  Random random(3);
  for (float& x : cloud.means) x = static_cast<float>(random.Uniform());
  for (float& x : cloud.log_scales) x = static_cast<float>(random.Uniform(-6, -2));
  return cloud;
}

// Against sorting all distances.
TEST(GaussianRegions, MatchSortingAllDistances) {
  for (const int64_t count : {2, 9, 65, 300, 1000}) {
    const GaussianCloud cloud = RandomCloud(count);
    const GaussianRegions regions(cloud);
    for (int64_t i = 0; i < count; i += 1 + count / 7) {
      std::vector<std::pair<double, int64_t>> others;  // squared distance, row; itself is the first
      for (int64_t j = 0; j < count; ++j) {
        double squared = 0;
        for (int64_t a = 0; a < 3; ++a) {
          const auto at = [&](int64_t row) { return double{cloud.means[static_cast<size_t>(3 * row + a)]}; };
          squared += (at(i) - at(j)) * (at(i) - at(j));
        }
        others.emplace_back(squared, j);
      }
      std::sort(others.begin(), others.end());
      const auto side = [&](int64_t wanted) {
        const int64_t last = std::min(wanted, count - 1);
        return std::sqrt(std::numbers::pi * others[static_cast<size_t>(last)].first / static_cast<double>(last));
      };
      const auto median_of_64 = [&](auto&& of_scales) {
        std::vector<double> values;
        for (size_t k = 0; k < std::min<size_t>(65, others.size()); ++k) {
          std::array<float, 3> scales;
          std::copy_n(cloud.log_scales.data() + 3 * others[k].second, 3, scales.begin());
          std::sort(scales.begin(), scales.end());
          values.push_back(of_scales(scales));
        }
        std::sort(values.begin(), values.end());
        return 0.5 * (values[(values.size() - 1) / 2] + values[values.size() / 2]);
      };
      const GaussianRegion region = regions.Around(cloud.means.data() + 3 * i);
      EXPECT_NEAR(region.spacing, side(8), 1e-9);
      EXPECT_NEAR(region.wide, side(64), 1e-9);
      EXPECT_NEAR(regions.SpacingOfMany(cloud.means.data() + 3 * i), side(512), 1e-9);
      EXPECT_NEAR(region.width, median_of_64([](const auto& s) { return std::exp(double{s[1]}); }), 1e-6);
      EXPECT_NEAR(region.footprint, median_of_64([](const auto& s) { return std::exp(0.5 * (double{s[1]} + s[2])); }),
                  1e-6);
      EXPECT_DOUBLE_EQ(region.HarmlessPixel(), std::min(0.75 * region.width, 0.3 * region.wide));
    }
  }
}

TEST(GaussianRegions, OfASampleAreThoseOfAll) {
  const GaussianCloud all = RandomCloud(300);
  const float* place = all.means.data();
  const GaussianRegion few = GaussianRegions(all, 9).Around(place), plain = GaussianRegions(all).Around(place);
  EXPECT_NEAR(few.wide, plain.wide / 3, 1e-9);
  EXPECT_EQ(few.width, plain.width);
}

TEST(GaussianRegions, NothingIsHarmlessWhereNothingIsKnown) {
  const float place[3] = {0, 0, 0};
  for (const int64_t count : {0, 1}) {
    EXPECT_EQ(GaussianRegions(RandomCloud(count)).Around(place).HarmlessPixel(), 0);
  }
  GaussianCloud one_place = RandomCloud(500);
  std::ranges::fill(one_place.means, 0.0f);
  EXPECT_EQ(GaussianRegions(one_place).Around(place).HarmlessPixel(), 0);
}

}  // namespace
}  // namespace anchorsplat
