#include "compact/compact_output.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "compact/choose_copies_for_test.h"
#include "compact/compact_network.h"
#include "compact/sheet_cloud_for_test.h"
#include "enhance/filter.h"

namespace anchorsplat {
namespace {

constexpr int64_t kCount = 900;

// Of which some Gaussians are unlike the training data.
CompactNetwork Network() {
  auto network = CompactNetwork::Load({}, [](const TensorSpec& tensor, std::span<float> values) -> Status {
    const Status status = OpenDomain()(tensor, values);
    if (tensor.name == "domain.high") values[0] = 1;
    return status;
  });
  EXPECT_TRUE(network.ok());
  return *std::move(network);
}

GaussianCloud Sheet() {
  GaussianCloud cloud = SheetCloud(kCount);
  for (size_t i = 5; i < static_cast<size_t>(kCount); i += 50) {
    for (size_t c = 0; c < 3; ++c) cloud.log_scales[3 * i + c] = std::log(kSheetPixel) + (c == 0 ? 4.0f : -4.0f);
  }
  // Copies of equal cost.
  for (size_t i = 100; i < 140; ++i) cloud.opacity_logits[i] = -std::numeric_limits<float>::infinity();
  return cloud;
}

void ExpectSameValues(const GaussianCloud& a, const GaussianCloud& b) {
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(a.sh_degree, b.sh_degree);
  EXPECT_EQ(a.means, b.means);
  EXPECT_EQ(a.log_scales, b.log_scales);
  EXPECT_EQ(a.quats, b.quats);
  EXPECT_EQ(a.opacity_logits, b.opacity_logits);
  EXPECT_EQ(a.sh, b.sh);
}

// Chosen block by block, copies are those that are chosen when all of them are there.
TEST(CompactOutput, BlocksAreChosenAsTheWhole) {
  const GaussianCloud cloud = Sheet();
  const CompactNetwork network = Network();
  std::vector<float> pixels;
  for (int64_t i = 0; i < kCount; ++i) pixels.push_back(kSheetPixel * (1 + 0.1f * std::sin(static_cast<float>(i))));
  const float one = kSheetPixel;
  std::vector<int64_t> single;
  for (int64_t i = 3; i < kCount; i += 7) single.push_back(i);
  const CopyChoice choices[] = {{.copies = 2},
                                {.copies = 4},
                                {.merge_cost = 1e-3},
                                {.merge_cost = 1e-3, .invisible = 0.05f},
                                {.copies = 4, .max_gaussians = 2000},
                                {.merge_cost = 1e-6, .max_gaussians = 1500},
                                {.max_gaussians = 3599},
                                {.max_gaussians = 3600},
                                {.max_gaussians = 901},
                                {.max_gaussians = 300}};
  for (const bool each : {false, true}) {
    CompactTask task{.pixel_sizes = each ? std::span<const float>(pixels) : std::span<const float>(&one, 1),
                     .upscale = 4,
                     .strength = DefaultFilterStrength(4)};
    const auto all = network.Apply(cloud, task);
    ASSERT_TRUE(all.ok());
    ASSERT_EQ(all->unlike_training, 18);
    for (const CopyChoice& choice : choices) {
      const int64_t inside = kCount - all->unlike_training;
      CopyGroups groups{.count = inside, .copies = 4, .pixel_sizes = {}};
      for (int64_t i = 0; i < kCount; ++i) {
        if (i % 50 == 5) continue;  // stays alone
        const float pixel = task.pixel_sizes[each ? static_cast<size_t>(i) : 0];
        groups.pixel_sizes.push_back(static_cast<float>(pixel / task.upscale));
        if (!choice.copies) groups.single.push_back(i % 7 == 3 ? 1 : 0);
      }
      GaussianCloud expected = all->cloud;
      const auto chosen = ChooseCopies(groups, choice, expected);
      ASSERT_TRUE(chosen.ok());
      task.choice = choice;
      if (!choice.copies) task.single = single;
      for (const int64_t block : {int64_t{97}, int64_t{400}, kCount}) {
        SCOPED_TRACE(block);
        task.block_gaussians = block;
        const auto blocks = network.Apply(cloud, task);
        ASSERT_TRUE(blocks.ok());
        EXPECT_EQ(blocks->made, 4 * inside + all->unlike_training);
        EXPECT_EQ(blocks->chosen.merged, chosen->merged);
        EXPECT_EQ(blocks->chosen.left_out, chosen->left_out);
        ExpectSameValues(blocks->cloud, expected);
      }
      task.choice.reset();
      task.single = {};
    }
  }
}

// The same where another network's Gaussian may stand for all copies.
TEST(CompactOutput, StandInsAreChosenAsInTheWhole) {
  const GaussianCloud cloud = Sheet();
  const CompactNetwork network = Network();
  // Like the network's own copies, whose filter it shares; the domain is open, or else it says nothing of some.
  const auto one = CompactNetwork::Load({.copies = 1}, OpenDomain());
  ASSERT_TRUE(one.ok());
  const float pixel = kSheetPixel;
  CompactTask task{.pixel_sizes = {&pixel, 1}, .upscale = 4, .strength = DefaultFilterStrength(4)};
  const auto all = network.Apply(cloud, task), stand_ins = one->Apply(cloud, task);
  ASSERT_TRUE(all.ok() && stand_ins.ok());
  ASSERT_EQ(stand_ins->cloud.size(), kCount);
  const int64_t inside = kCount - all->unlike_training;
  std::vector<int64_t> rows, of_stand_ins;
  for (int64_t i = 0; i < 4 * inside; ++i) rows.push_back(i);
  for (int64_t i = 0; i < kCount; ++i) {
    if (i % 50 != 5) of_stand_ins.push_back(i);
  }
  GaussianCloud copies = Subset(all->cloud, rows).value();
  ASSERT_TRUE(Append(copies, Subset(stand_ins->cloud, of_stand_ins).value()).ok());
  task.stand_in = &*one;
  int64_t came = 0;
  for (const CopyChoice& choice :
       {CopyChoice{.merge_cost = 3e-3}, CopyChoice{.merge_cost = 3e-3, .invisible = 0.05f},
        CopyChoice{.merge_cost = 1e-6, .max_gaussians = 1500}, CopyChoice{.max_gaussians = 901}}) {
    GaussianCloud expected = copies;
    CopyGroups groups{.count = inside, .copies = 4, .pixel_sizes = {pixel / 4}, .stand_ins = true};
    CopyChoice of_copies = choice;
    if (of_copies.max_gaussians > 0) of_copies.max_gaussians -= all->unlike_training;
    ASSERT_TRUE(ChooseCopies(groups, of_copies, expected).ok());
    task.choice = choice;
    for (const int64_t block : {int64_t{97}, int64_t{400}, kCount}) {
      SCOPED_TRACE(block);
      task.block_gaussians = block;
      const auto blocks = network.Apply(cloud, task);
      ASSERT_TRUE(blocks.ok());
      EXPECT_EQ(blocks->made, 4 * inside + all->unlike_training);
      EXPECT_EQ(blocks->chosen.merged, blocks->made - blocks->cloud.size());
      // Without those that stand alone, which are put in order among the stand-ins.
      std::vector<int64_t> others;
      for (int64_t row = 0; row < blocks->cloud.size(); ++row) {
        const float* mean = blocks->cloud.means.data() + 3 * row;
        bool alone = false;
        for (int64_t i = 5; i < kCount; i += 50) alone |= std::equal(mean, mean + 3, cloud.means.data() + 3 * i);
        if (!alone) others.push_back(row);
      }
      ExpectSameValues(Subset(blocks->cloud, others).value(), expected);
      for (int64_t row = 0; row < expected.size(); ++row) {
        for (const int64_t i : of_stand_ins) {
          came += std::equal(expected.means.data() + 3 * row, expected.means.data() + 3 * row + 3,
                             stand_ins->cloud.means.data() + 3 * i);
        }
      }
    }
  }
  EXPECT_GT(came, 100);
  // Whoever asks for a number of copies gets those.
  for (const int64_t number : {2, 4}) {
    task.choice = CopyChoice{.copies = number};
    CompactTask without = task;
    without.stand_in = nullptr;
    ExpectSameValues(network.Apply(cloud, task)->cloud, network.Apply(cloud, without)->cloud);
  }
}

TEST(CompactOutput, RefusesAStandInOfAnotherShape) {
  const float pixel = kSheetPixel;
  CompactTask task{.pixel_sizes = {&pixel, 1}, .choice = CopyChoice{}};
  for (const CompactConfig& config :
       {CompactConfig{.copies = 2}, CompactConfig{.copies = 1, .rounds = 1},
        CompactConfig{.copies = 1, .neighbours = 7}, CompactConfig{.copies = 1, .knows_kind = true}}) {
    const auto other = CompactNetwork::Load(config, OpenDomain());
    ASSERT_TRUE(other.ok());
    task.stand_in = &*other;
    const auto result = Network().Apply(Sheet(), task);
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.error().code, ErrorCode::kBadArgument);
  }
}

// Those of a region are what they are in the whole.
TEST(CompactOutput, OnlyThoseInsideComeOut) {
  const GaussianCloud cloud = Sheet();
  const CompactNetwork network = Network();
  const float pixel = kSheetPixel;
  CompactTask task{.pixel_sizes = {&pixel, 1}, .upscale = 4, .strength = DefaultFilterStrength(4)};
  const auto all = network.Apply(cloud, task);
  ASSERT_TRUE(all.ok());
  std::vector<char> inside(static_cast<size_t>(kCount));
  std::vector<int64_t> rows;  // of the whole result
  for (int64_t k = 0, row = 0; k < 5; ++k) {
    for (int64_t i = 0; i < kCount; ++i) {
      if ((i % 50 == 5) != (k == 4)) continue;  // those that stay alone stand behind
      inside[static_cast<size_t>(i)] = cloud.means[static_cast<size_t>(3 * i)] < 0.1f ? 1 : 0;
      if (inside[static_cast<size_t>(i)] != 0) rows.push_back(row);
      ++row;
    }
  }
  task.in_region = inside;
  for (const int64_t block : {int64_t{97}, kCount}) {
    task.block_gaussians = block;
    const auto part = network.Apply(cloud, task);
    ASSERT_TRUE(part.ok());
    ExpectSameValues(part->cloud, Subset(all->cloud, rows).value());
  }
}

TEST(CompactOutput, RefusesAChoiceWithoutMeaning) {
  const float pixel = kSheetPixel;
  const auto result = Network().Apply(Sheet(), {.pixel_sizes = {&pixel, 1}, .choice = CopyChoice{.copies = 5}});
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code, ErrorCode::kBadArgument);
}

// Of equally cheap merges those of the first Gaussians, whatever plan they are in.
TEST(MergeMore, GoesByTheOrderOfTheGaussians) {
  std::vector<CopyPlan> plans;
  std::vector<GaussianCloud> clouds(2);
  for (size_t p = 0; p < 2; ++p) {
    for (int row = 0; row < 2 * 3; ++row) ASSERT_TRUE(Append(clouds[p], SheetCloud(1)).ok());
    plans.emplace_back(CopyGroups{3, 2, {kSheetPixel}}, CopyChoice{.copies = 2, .max_gaussians = 1}, clouds[p]);
    EXPECT_EQ(plans.back().merged(), 0);
  }
  // Gaussians 5, 3, 1 and 4, 2, 0.
  MergeMore(plans, 2, [](size_t plan, int64_t group) { return 5 - 2 * group - static_cast<int64_t>(plan); });
  const std::vector<std::vector<char>> expected = {{1, 1, 1, 1, 1, 0}, {1, 1, 1, 1, 1, 0}};
  for (size_t p = 0; p < 2; ++p) {
    std::vector<char> keep(6, 1);
    plans[p].ApplyTo(clouds[p], keep);
    EXPECT_EQ(plans[p].merged(), 1);
    EXPECT_EQ(keep, expected[p]);
  }
}

}  // namespace
}  // namespace anchorsplat
