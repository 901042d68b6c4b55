#include "enhance/cloud_components.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <vector>

#include "core/random.h"
#include "core/source_dir_for_test.h"
#include "formats/cloud_io.h"

namespace anchorsplat {
namespace {

// Opaque grey Gaussians on a sphere.
GaussianCloud Sphere(int64_t count, double radius, std::array<double, 3> middle, uint64_t seed) {
  GaussianCloud cloud;
  cloud.Resize(count, 0);
  std::ranges::fill(cloud.log_scales, -4.0f);
  std::ranges::fill(cloud.quats, 0.5f);
  std::ranges::fill(cloud.opacity_logits, 3.0f);
  std::ranges::fill(cloud.sh, 0.5f);
  Random random(seed);
  for (size_t i = 0; i < static_cast<size_t>(count); ++i) {
    std::array<double, 3> at;
    for (double& x : at) x = random.Normal();
    const double norm = std::hypot(at[0], at[1], at[2]);
    for (size_t a = 0; a < 3; ++a) cloud.means[3 * i + a] = static_cast<float>(middle[a] + radius * at[a] / norm);
  }
  return cloud;
}

GaussianCloud Together(std::initializer_list<GaussianCloud> parts) {
  GaussianCloud all;
  for (const GaussianCloud& part : parts) EXPECT_TRUE(Append(all, part).ok());
  return all;
}

// The rule without trees and sets: neighbours of neighbours until none is new. The number of each Gaussian's component,
// by its first member.
std::vector<size_t> ByWalking(const GaussianCloud& cloud) {
  const auto n = static_cast<size_t>(cloud.size());
  const auto squared = [&](size_t i, size_t j) {
    double sum = 0;
    for (size_t a = 0; a < 3; ++a) sum += std::pow(double{cloud.means[3 * i + a]} - double{cloud.means[3 * j + a]}, 2);
    return sum;
  };
  std::vector<std::vector<std::pair<double, size_t>>> nearest(n);
  for (size_t i = 0; i < n; ++i) {
    std::vector<std::pair<double, size_t>> all;
    for (size_t j = 0; j < n; ++j) {
      if (j != i) all.emplace_back(squared(i, j), j);
    }
    std::ranges::partial_sort(all, all.begin() + 12);
    nearest[i].assign(all.begin(), all.begin() + 12);
  }
  std::vector<std::vector<size_t>> joined(n);
  for (size_t i = 0; i < n; ++i) {
    for (const auto& [distance, j] : nearest[i]) {
      const double here = std::sqrt(nearest[i][3].first), there = std::sqrt(nearest[j][3].first);
      if (std::sqrt(distance) > 3 * std::min(here, there) || here > 2 * there || there > 2 * here) continue;
      joined[i].push_back(j);
      joined[j].push_back(i);
    }
  }
  std::vector<size_t> first(n, n);
  for (size_t i = 0; i < n; ++i) {
    if (first[i] < n) continue;
    std::vector<size_t> open = {i};
    first[i] = i;
    while (!open.empty()) {
      const size_t at = open.back();
      open.pop_back();
      for (const size_t next : joined[at]) {
        if (first[next] < n) continue;
        first[next] = i;
        open.push_back(next);
      }
    }
  }
  return first;
}

TEST(CloudComponents, MatchWalkingFromNeighbourToNeighbour) {
  // Of two spheres, and a third one of too few.
  const GaussianCloud cloud =
      Together({Sphere(1500, 1, {0, 0, 0}, 1), Sphere(2000, 2, {4, 0, 0}, 2), Sphere(300, 0.2, {0, 3, 0}, 3)});
  const CloudComponents found = FindComponents(cloud);
  ASSERT_EQ(found.count, 2);
  const std::vector<size_t> first = ByWalking(cloud);
  EXPECT_GE(std::ranges::count(first, size_t{0}), 1400);
  EXPECT_GE(std::ranges::count(first, size_t{1500}), 1900);
  for (size_t i = 0; i < 3500; ++i) {
    if (first[i] == 0 || first[i] == 1500) {
      ASSERT_EQ(found.component[i], first[i] == 1500 ? 0 : 1) << "the largest first";
    }
  }
  for (size_t i = 3500; i < 3800; ++i) ASSERT_EQ(found.component[i], CloudComponents::kNone) << "too small, and aside";
}

TEST(CloudComponents, FloatersAndBlackVeilsJoinNothing) {
  GaussianCloud cloud = Together({Sphere(5000, 1, {0, 0, 0}, 1), Sphere(5000, 1, {3, 0, 0}, 2)});
  Random random(3);
  for (const bool black : {false, true}) {
    GaussianCloud between = Sphere(black ? 5000 : 300, 1, {0, 0, 0}, 4);
    if (black) std::ranges::fill(between.sh, -1.7724539f);
    for (float& x : between.means) x = static_cast<float>(4 * random.Uniform() - 0.5);
    ASSERT_TRUE(Append(cloud, between).ok());
  }
  const CloudComponents found = FindComponents(cloud);
  ASSERT_EQ(found.count, 2);
  for (size_t i = 0; i < 10'000; ++i)
    ASSERT_EQ(found.component[i], i < 5000 ? found.component[0] : 1 - found.component[0]);
}

TEST(CloudComponents, OneObjectIsOfOnePiece) {
  for (const char* object : {"biplane", "stone_lantern", "tankard"}) {
    const auto cloud = ReadCloud(SourceDirForTest() / "examples" / object / "input.ply");
    ASSERT_TRUE(cloud.ok());
    EXPECT_EQ(FindComponents(*cloud).count, 1) << object;
  }
}

// A small splat beside a large one is none of its pieces; a wheel is.
TEST(CloudComponents, SmallPiecesAsideAreNoPartOfThings) {
  const GaussianCloud large = Sphere(5000, 1, {0, 0, 0}, 1);
  const CloudComponents wheel = FindComponents(Together({large, Sphere(500, 0.3, {0, 0, 1.4}, 2)}));
  EXPECT_TRUE(wheel.component.empty());
  const CloudComponents aside = FindComponents(Together({large, Sphere(500, 0.3, {0, 0, 2}, 2)}));
  EXPECT_EQ(aside.count, 1);
  ASSERT_EQ(std::ssize(aside.component), 5500);
  for (size_t i = 0; i < 5500; ++i) ASSERT_EQ(aside.component[i], i < 5000 ? 0 : CloudComponents::kNone);
  // Nothing but small ones.
  const CloudComponents small = FindComponents(
      Together({Sphere(700, 0.3, {0, 0, 0}, 1), Sphere(800, 0.3, {3, 0, 0}, 2), Sphere(600, 0.3, {6, 0, 0}, 3)}));
  EXPECT_EQ(small.count, 1);
  ASSERT_EQ(std::ssize(small.component), 2100);
  EXPECT_EQ(std::ranges::count(small.component, 0), 800);
}

// More than are looked at, by a small and a large scale.
TEST(CloudComponents, OfManyASampleIsEnough) {
  const GaussianCloud cloud = Together({Sphere(30'000, 1e-3, {0, 0, 0}, 1), Sphere(90'000, 1e3, {0, 0, 0}, 2)});
  const CloudComponents found = FindComponents(cloud);
  ASSERT_EQ(found.count, 2);
  EXPECT_EQ(std::ranges::count(found.component, 1), 30'000);
  EXPECT_EQ(found.component[0], 1);
}

TEST(CloudComponents, OddCloudsAreOfOnePiece) {
  EXPECT_EQ(FindComponents({}).count, 1);
  EXPECT_EQ(FindComponents(Sphere(1, 1, {0, 0, 0}, 1)).count, 1);
  GaussianCloud one_place = Sphere(10'000, 0, {1, 2, 3}, 1);
  EXPECT_EQ(FindComponents(one_place).count, 1);
  std::ranges::fill(one_place.means, std::numeric_limits<float>::quiet_NaN());
  EXPECT_EQ(FindComponents(one_place).count, 1);

  GaussianCloud cloud = Together({Sphere(5000, 1, {0, 0, 0}, 1), Sphere(5000, 1, {5, 0, 0}, 2)});
  cloud.means[0] = std::numeric_limits<float>::infinity();
  cloud.log_scales[4] = std::numeric_limits<float>::quiet_NaN();
  const CloudComponents found = FindComponents(cloud);
  EXPECT_EQ(found.count, 2);
  EXPECT_EQ(std::ssize(found.component), cloud.size());
}

}  // namespace
}  // namespace anchorsplat
