#include "enhance/pixel_sizes_of_things.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/random.h"
#include "core/source_dir_for_test.h"
#include "enhance/cloud_components.h"
#include "formats/cloud_io.h"

namespace anchorsplat {
namespace {

constexpr double kPixelOfExamples = 0.0055013;  // of both examples

GaussianCloud Placed(const char* object, double scale = 1, std::array<double, 3> at = {0, 0, 0}) {
  const std::filesystem::path path = SourceDirForTest() / object;
  auto cloud = ReadCloud(path.extension().empty() ? SourceDirForTest() / "examples" / object / "input.ply" : path);
  EXPECT_TRUE(cloud.ok());
  if (!cloud.ok()) return {};
  for (size_t i = 0; i < cloud->means.size(); ++i) {
    cloud->means[i] = static_cast<float>(scale * double{cloud->means[i]} + at[i % 3]);
  }
  for (float& x : cloud->log_scales) x += static_cast<float>(std::log(scale));
  return *std::move(cloud);
}

// Far surroundings: opaque Gaussians on a sphere, as large as they are far apart.
GaussianCloud Sky(int64_t count, double radius) {
  GaussianCloud cloud;
  cloud.Resize(count, 0);
  const double spacing = radius * std::sqrt(12.6 / static_cast<double>(count));
  std::ranges::fill(cloud.log_scales, static_cast<float>(std::log(0.5 * spacing)));
  std::ranges::fill(cloud.quats, 0.5f);
  std::ranges::fill(cloud.opacity_logits, 3.0f);
  std::ranges::fill(cloud.sh, 0.5f);
  Random random(5);
  for (size_t i = 0; i < static_cast<size_t>(count); ++i) {
    std::array<double, 3> at;
    for (double& x : at) x = random.Normal();
    const double norm = std::hypot(at[0], at[1], at[2]);
    for (size_t a = 0; a < 3; ++a) cloud.means[3 * i + a] = static_cast<float>(radius * at[a] / norm);
  }
  return cloud;
}

PixelSizesOfThings Find(const GaussianCloud& cloud) {
  const auto whole = FindPixelSize(cloud);
  EXPECT_TRUE(whole.ok());
  return whole.ok() ? FindPixelSizesOfThings(cloud, *whole, true) : PixelSizesOfThings{};
}

std::span<const float> FirstOf(const Buffer<float>& sizes, const GaussianCloud& part) {
  return std::span(sizes).first(static_cast<size_t>(part.size()));
}

// But for a few floaters.
void ExpectAll(std::span<const float> sizes, double truth, double tolerance = 0.1) {
  const auto near = [&](float size) { return std::abs(double{size} - truth) < tolerance * truth; };
  EXPECT_GE(std::ranges::count_if(sizes, near), std::ssize(sizes) * 99 / 100);
}

TEST(PixelSizesOfThings, EachGetsItsOwn) {
  const GaussianCloud lantern = Placed("stone_lantern");
  GaussianCloud cloud = lantern;
  ASSERT_TRUE(Append(cloud, Placed("biplane", 3, {4, 0, 0})).ok());
  const PixelSizesOfThings found = Find(cloud);
  ASSERT_EQ(found.things.size(), 2u);
  EXPECT_TRUE(ContradictionsOf(found.things).empty());
  ASSERT_EQ(std::ssize(found.sizes), cloud.size());
  ExpectAll(FirstOf(found.sizes, lantern), kPixelOfExamples);
  ExpectAll(std::span(found.sizes).subspan(static_cast<size_t>(lantern.size())), 3 * kPixelOfExamples);
  EXPECT_GE(std::ranges::count(found.sure, 1), cloud.size() * 99 / 100);
}

// A twentieth of the Gaussians, so that no quantile of all sees it.
TEST(PixelSizesOfThings, HoweverFewTheyAre) {
  const GaussianCloud lantern = Placed("stone_lantern");
  GaussianCloud cloud = lantern;
  for (int k = 0; k < 6; ++k) {
    for (int side = -1; side <= 1; side += 2) {
      ASSERT_TRUE(Append(cloud, Placed("biplane", 3, {4.0 * (k - 2.5), 4.0 * side, 0})).ok());
    }
  }
  const PixelSizesOfThings found = Find(cloud);
  ASSERT_EQ(found.things.size(), 13u);
  ExpectAll(FirstOf(found.sizes, lantern), kPixelOfExamples);
  EXPECT_NE(InWords(found.things).find("13 things that lie apart"), std::string::npos);
  EXPECT_NE(InWords(found.things).find("; and 9 more"), std::string::npos) << InWords(found.things);
}

// Too small to tell, and much finer than what lies beside it.
TEST(PixelSizesOfThings, WhatIsTooSmallToTellIsNotBlurred) {
  const GaussianCloud lantern = Placed("stone_lantern", 8, {8, 0, 0});
  GaussianCloud small = Placed("biplane");
  std::vector<int64_t> every;
  for (int64_t i = 0; i < small.size(); i += 25) every.push_back(i);
  small = Subset(small, every).value();
  GaussianCloud cloud = small;
  ASSERT_TRUE(Append(cloud, lantern).ok());
  const PixelSizesOfThings found = Find(cloud);
  ASSERT_EQ(found.things.size(), 2u);
  EXPECT_GE(std::ranges::count(found.sure, 0), small.size() * 9 / 10);
  const auto own = FirstOf(found.sizes, small);
  EXPECT_LT(std::ranges::count_if(own, [](float size) { return size > 4 * kPixelOfExamples; }), small.size() / 10);
  EXPECT_NE(ContradictionsOf(found.things).back().find("too small to tell"), std::string::npos);
}

// Loose Gaussians and small pieces of one thing are of its training where they are no finer than its pixels.
TEST(PixelSizesOfThings, SmallPiecesThatAreNoFinerAreOfTheSame) {
  const GaussianCloud biplane = Placed("biplane");
  const auto beside = [&](double spacing) {
    GaussianCloud cloud = biplane, pieces;
    constexpr int kPieces = 4, kSide = 16;
    pieces.Resize(int64_t{kPieces} * kSide * kSide, cloud.sh_degree);
    std::ranges::fill(pieces.quats, 0.5f);
    std::ranges::fill(pieces.opacity_logits, 3.0f);
    std::ranges::fill(pieces.sh, 0.5f);
    std::ranges::fill(pieces.log_scales, static_cast<float>(std::log(0.8 * spacing)));
    for (size_t i = 0; i < pieces.opacity_logits.size(); ++i) {
      const double piece = std::floor(static_cast<double>(i) / (kSide * kSide));
      pieces.means[3 * i] = static_cast<float>(0.8 + spacing * static_cast<double>(i % kSide));
      pieces.means[3 * i + 1] = static_cast<float>(-0.6 + 0.4 * piece);
      pieces.means[3 * i + 2] = static_cast<float>(spacing * static_cast<double>(i / kSide % kSide));
    }
    EXPECT_TRUE(Append(cloud, pieces).ok());
    return cloud;
  };
  EXPECT_TRUE(Find(beside(2 * kPixelOfExamples)).things.empty());
  const GaussianCloud finer = beside(0.4 * kPixelOfExamples);
  const PixelSizesOfThings found = Find(finer);
  ASSERT_EQ(found.things.size(), 2u);
  EXPECT_FALSE(found.things[0].finding.contradicted());
  EXPECT_NE(ContradictionsOf(found.things).back().find("too small to tell"), std::string::npos);
  EXPECT_EQ(std::ranges::count(std::span(found.sure).subspan(static_cast<size_t>(biplane.size())), 1), 0);
}

// What has lost no width stays, whoever lies beside it, unless somebody says better.
TEST(PixelSizesOfThings, WideOnesStay) {
  GaussianCloud wide = Placed("biplane");
  for (float& x : wide.log_scales) x = std::max(x, static_cast<float>(std::log(0.5 * kPixelOfExamples)));
  GaussianCloud cloud = wide;
  ASSERT_TRUE(Append(cloud, Placed("stone_lantern", 1, {2, 0, 0})).ok());
  ASSERT_TRUE(Append(cloud, Placed("tankard", 1, {0, 3, 0})).ok());
  const PixelSizesOfThings found = Find(cloud);
  ASSERT_EQ(found.things.size(), 3u);
  for (const float size : FirstOf(found.sizes, wide)) ASSERT_LT(size, 1e-6 * kPixelOfExamples);
  const auto whole = FindPixelSize(cloud);
  ASSERT_TRUE(whole.ok());
  const PixelSizesOfThings said = FindPixelSizesOfThings(cloud, *whole, false);
  const auto given_back = [](float size) { return size > 0.3 * kPixelOfExamples; };
  EXPECT_GE(std::ranges::count_if(FirstOf(said.sizes, wide), given_back), wide.size() * 99 / 100);
}

TEST(PixelSizesOfThings, WhatLiesAroundIsTreatedWithCaution) {
  const GaussianCloud biplane = Placed("biplane");
  GaussianCloud cloud = biplane;
  ASSERT_TRUE(Append(cloud, Sky(40'000, 10)).ok());
  const PixelSizesOfThings found = Find(cloud);
  ASSERT_EQ(found.things.size(), 2u);
  ExpectAll(FirstOf(found.sizes, biplane), kPixelOfExamples);
  EXPECT_GE(std::ranges::count(found.sure, 1), biplane.size() * 99 / 100);
  EXPECT_LE(std::ranges::count(found.sure, 1), biplane.size());
  const std::vector<std::string> doubts = ContradictionsOf(found.things);
  ASSERT_FALSE(doubts.empty());
  EXPECT_EQ(doubts.back(), "of 40,000 Gaussians that lie apart: it lies around others") << doubts.front();
}

// Black Gaussians around one of them say nothing about the other.
TEST(PixelSizesOfThings, BlackVeilsOfOneDoNotSpeakForTheOther) {
  const GaussianCloud lantern = Placed("stone_lantern");
  GaussianCloud cloud = lantern, veiled = Placed("biplane", 4, {6, 0, 0});
  GaussianCloud veils = Sky(3000, 1);
  std::ranges::fill(veils.sh, -1.7724539f);
  std::ranges::fill(veils.log_scales, static_cast<float>(std::log(0.2)));
  Random random(3);
  for (size_t i = 0; i < veils.means.size(); ++i) {
    veils.means[i] = static_cast<float>((i % 3 == 0 ? 6.0 : 0.0) + 4 * (random.Uniform() - 0.5));
  }
  ASSERT_TRUE(Append(veiled, veils).ok());
  ASSERT_TRUE(Append(cloud, veiled).ok());
  const PixelSizesOfThings found = Find(cloud);
  ASSERT_EQ(found.things.size(), 2u);
  ExpectAll(FirstOf(found.sizes, lantern), kPixelOfExamples);
}

// 2,707 Gaussians of the horse lie apart; outlines of so few count less where they are alone.
TEST(PixelSizesOfThings, FewThatSayTheSameAreOfThatTraining) {
  const GaussianCloud horse = Placed("testdata/splats/rocking-horse.spz");
  EXPECT_TRUE(Find(horse).things.empty());
  // The same few from finer pictures: what they say is another size, and they are believed no more than before.
  const auto components = FindComponents(horse);
  ASSERT_EQ(components.count, 2);
  GaussianCloud finer = horse;
  for (size_t i = 0; i < static_cast<size_t>(horse.size()); ++i) {
    if (components.component[i] != 1) continue;
    for (size_t a = 0; a < 3; ++a) {
      finer.means[3 * i + a] = 0.5f * finer.means[3 * i + a] - (a == 1 ? 1.0f : 0.0f);
      finer.log_scales[3 * i + a] -= std::log(2.0f);
    }
  }
  const PixelSizesOfThings found = Find(finer);
  ASSERT_GE(found.things.size(), 2u);
  const PixelSizeFinding& few = found.things[1].finding;
  EXPECT_GT(few.of_more, 0);
  EXPECT_LT(few.size, 0.8 * few.of_more);
}

TEST(PixelSizesOfThings, ThingsThatSayTheSameAreOfOneTraining) {
  GaussianCloud cloud = Placed("stone_lantern");
  ASSERT_TRUE(Append(cloud, Placed("biplane", 1, {2, 0, 0})).ok());
  EXPECT_TRUE(Find(cloud).things.empty());
  // A third larger: perhaps an error of the estimate. The smaller one is the safer one.
  cloud = Placed("stone_lantern");
  ASSERT_TRUE(Append(cloud, Placed("biplane", 1.35, {2, 0, 0})).ok());
  const auto whole = FindPixelSize(cloud);
  ASSERT_TRUE(whole.ok() && !whole->contradicted());
  const PixelSizesOfThings found = FindPixelSizesOfThings(cloud, *whole, true);
  ASSERT_EQ(found.things.size(), 2u);
  EXPECT_LE(std::ranges::max(found.sizes), static_cast<float>(whole->size));
  EXPECT_TRUE(Find(Placed("tankard")).things.empty());
}

}  // namespace
}  // namespace anchorsplat
