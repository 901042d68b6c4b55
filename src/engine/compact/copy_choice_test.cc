#include "compact/copy_choice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "compact/choose_copies_for_test.h"
#include "compact/compact_network.h"
#include "compact/copy_group.h"
#include "compact/sheet_cloud_for_test.h"
#include "core/activations.h"
#include "core/parallel.h"
#include "core/random.h"
#include "core/rotation.h"
#include "core/spherical_harmonics.h"
#include "enhance/filter.h"

namespace anchorsplat {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kClosePixel = kSheetPixel / 4;

CopyGroups Groups(int64_t count, int64_t copies) { return {count, copies, {kClosePixel}}; }

bool SameValues(const GaussianCloud& a, const GaussianCloud& b) {
  return a.means == b.means && a.log_scales == b.log_scales && a.quats == b.quats &&
         a.opacity_logits == b.opacity_logits && a.sh == b.sh;
}

// What a network that says nothing makes of a cloud: the copies of CopyStart.
GaussianCloud Untrained(const GaussianCloud& cloud, const CompactConfig& config) {
  const WeightSource silent = OpenDomain([](const TensorSpec& tensor, std::span<float> values) -> Status {
    if (tensor.name.starts_with("out.")) {
      std::fill(values.begin(), values.end(), 0.0f);
      return {};
    }
    return HashWeights()(tensor, values);
  });
  const auto network = CompactNetwork::Load(config, silent);
  EXPECT_TRUE(network.ok());
  const float pixel = kSheetPixel;
  auto result = network->Apply(cloud, {.pixel_sizes = {&pixel, 1}, .upscale = 4, .strength = DefaultFilterStrength(4)});
  EXPECT_TRUE(result.ok());
  return std::move(result->cloud);
}

// Copies of each Gaussian at random places about it, as different as a network makes them.
GaussianCloud Copies(int64_t count, int64_t copies, double different, uint64_t seed = 3) {
  const GaussianCloud sheet = SheetCloud(count, 1);
  GaussianCloud cloud;
  for (int64_t k = 0; k < copies; ++k) EXPECT_TRUE(Append(cloud, sheet).ok());
  Random random(seed);
  for (float& x : cloud.means) x += static_cast<float>(different * kSheetPixel * random.Normal());
  for (float& x : cloud.log_scales) x += static_cast<float>(different * random.Normal());
  for (float& x : cloud.opacity_logits) x += static_cast<float>(different * random.Normal());
  for (float& x : cloud.sh) x += static_cast<float>(different * random.Normal());
  return cloud;
}

TEST(CopyChoice, UntrainedCopiesMergeBackIntoTheFilteredSplat) {
  GaussianCloud filtered = SheetCloud(400, 2);
  const GaussianCloud cloud = filtered;
  const float pixel = kSheetPixel;
  ASSERT_TRUE(ApplyFilter(filtered, {&pixel, 1}, {.upscale = 4, .strength = {}}).ok());
  for (const int64_t copies : {2, 4}) {
    GaussianCloud merged = Untrained(cloud, {.copies = copies});
    const auto done = ChooseCopies(Groups(400, copies), {.copies = 1}, merged);
    ASSERT_TRUE(done.ok()) << done.error().message;
    EXPECT_EQ(done->merged, 400 * (copies - 1));
    ASSERT_EQ(merged.size(), 400);
    for (int64_t i = 0; i < 400; ++i) {
      const auto at = static_cast<size_t>(i);
      const double before = Sigmoid(filtered.opacity_logits[at]), after = Sigmoid(merged.opacity_logits[at]);
      if (before < 0.1) continue;  // of whose copies little more than the limit of 1/255 is seen
      EXPECT_NEAR(after, before, 0.15 * before) << copies << ' ' << i;  // same mass, another peak
      std::array<float, 3> was, is;
      for (size_t c = 0; c < 3; ++c) {
        EXPECT_NEAR(merged.means[3 * at + c], filtered.means[3 * at + c], 0.1 * kSheetPixel);
        EXPECT_NEAR(merged.sh[27 * at + c], filtered.sh[27 * at + c], 1e-4);
        was[c] = filtered.log_scales[3 * at + c];
        is[c] = merged.log_scales[3 * at + c];
      }
      std::sort(was.begin(), was.end());
      std::sort(is.begin(), is.end());
      const double mass_before = std::log(before) + was[1] + was[2], mass_after = std::log(after) + is[1] + is[2];
      EXPECT_NEAR(mass_after, mass_before, 0.2) << copies << ' ' << i;
      for (size_t c = 1; c < 3; ++c) EXPECT_NEAR(is[c], was[c], 0.2) << copies << ' ' << i;
    }
  }
}

TEST(CopyChoice, CostSaysHowManyStay) {
  const GaussianCloud made = Copies(500, 4, 0.2);
  int64_t last = 2001;
  for (const double cost : {0.0, 1e-4, 1e-3, 1e-2, 1e9}) {
    GaussianCloud cloud = made;
    const auto done = ChooseCopies(Groups(500, 4), {.merge_cost = cost}, cloud);
    ASSERT_TRUE(done.ok());
    EXPECT_EQ(cloud.size(), 2000 - done->merged);
    EXPECT_LE(cloud.size(), last);
    if (cost == 1e-3) {
      EXPECT_THAT(cloud.size(), testing::AllOf(testing::Gt(500), testing::Lt(2000)));
    }
    last = cloud.size();
  }
  EXPECT_EQ(last, 500);
  for (const int64_t copies : {1, 2, 3, 4}) {
    GaussianCloud cloud = made;
    ASSERT_TRUE(ChooseCopies(Groups(500, 4), {.copies = copies}, cloud).ok());
    EXPECT_LE(cloud.size(), 500 * copies);  // invisible ones may be gone before
    if (copies == 4) {
      EXPECT_TRUE(SameValues(cloud, made));
    }
  }
}

TEST(CopyChoice, SomeGetNoCopies) {
  const GaussianCloud made = Copies(500, 4, 0.2);
  CopyGroups groups = Groups(500, 4);
  std::vector<char> single(500, 0);
  for (size_t g = 0; g < 500; g += 5) single[g] = 1;
  groups.single = single;
  GaussianCloud cloud = made;
  const auto done = ChooseCopies(groups, {.merge_cost = 0}, cloud);
  ASSERT_TRUE(done.ok());
  EXPECT_GE(done->merged, 300);
  GaussianCloud others = made;
  const auto without = ChooseCopies(Groups(500, 4), {.merge_cost = 0}, others);
  ASSERT_TRUE(without.ok());
  EXPECT_GE(done->merged, without->merged + 200);
  EXPECT_LE(done->merged, without->merged + 300);
}

TEST(CopyChoice, BudgetIsKeptExactlyAndByTheCheapest) {
  const GaussianCloud made = Copies(300, 4, 0.2);
  for (const int64_t most : {1199, 1000, 777, 301, 300, 299, 17, 1}) {
    GaussianCloud cloud = made;
    const auto done = ChooseCopies(Groups(300, 4), {.copies = 4, .max_gaussians = most}, cloud);
    ASSERT_TRUE(done.ok());
    EXPECT_EQ(cloud.size(), most);
    EXPECT_EQ(done->left_out, std::max<int64_t>(0, 300 - most));
    EXPECT_EQ(done->merged + done->left_out, 1200 - most);
  }
  GaussianCloud room = made;
  ASSERT_TRUE(ChooseCopies(Groups(300, 4), {.copies = 4, .max_gaussians = 1200}, room).ok());
  EXPECT_TRUE(SameValues(room, made));
  // A budget that a cost keeps by itself changes nothing, and one less is one merge more.
  GaussianCloud by_cost = made;
  ASSERT_TRUE(ChooseCopies(Groups(300, 4), {.merge_cost = 1e-3}, by_cost).ok());
  for (const int64_t less : {0, 1}) {
    GaussianCloud cloud = made;
    const int64_t most = by_cost.size() - less;
    ASSERT_TRUE(ChooseCopies(Groups(300, 4), {.copies = 4, .max_gaussians = most}, cloud).ok());
    EXPECT_EQ(cloud.size(), most);
    EXPECT_EQ(SameValues(cloud, by_cost), less == 0);
  }
}

TEST(CopyChoice, EqualCostsGoInOrder) {
  GaussianCloud cloud;
  for (int k = 0; k < 2 * 7; ++k) ASSERT_TRUE(Append(cloud, SheetCloud(1)).ok());
  for (size_t i = 0; i < 14; ++i) cloud.means[3 * i] = static_cast<float>(i % 7);
  cloud.opacity_logits.assign(14, 0.0f);
  ASSERT_TRUE(ChooseCopies(Groups(7, 2), {.copies = 2, .max_gaussians = 11}, cloud).ok());
  const std::vector<float> expected = {0, 1, 2, 3, 4, 5, 6, 3, 4, 5, 6};
  for (size_t i = 0; i < 11; ++i) EXPECT_NEAR(cloud.means[3 * i], expected[i], 1e-6) << i;
}

TEST(CopyChoice, SameBitsForAnyNumberOfThreads) {
  const GaussianCloud made = Copies(1500, 4, 0.2);
  for (const int64_t most : {int64_t{0}, int64_t{2000}}) {
    GaussianCloud one = made, three = made;
    SetThreadCount(1);
    ASSERT_TRUE(ChooseCopies(Groups(1500, 4), {.max_gaussians = most}, one).ok());
    SetThreadCount(3);
    ASSERT_TRUE(ChooseCopies(Groups(1500, 4), {.max_gaussians = most}, three).ok());
    SetThreadCount(0);
    EXPECT_TRUE(SameValues(one, three));
    EXPECT_LT(one.size(), 6000);
  }
}

TEST(CopyChoice, InvisibleCopiesGoForNothingAndLeaveNoTrace) {
  GaussianCloud cloud = Copies(50, 4, 1);
  for (size_t i = 0; i < 50; ++i) {
    cloud.opacity_logits[i] = 2;
    for (size_t k = 1; k < 4; ++k) cloud.opacity_logits[50 * k + i] = k == 2 ? -kInfinity : -7;
  }
  cloud.opacity_logits[0] = -8;  // of the first, the second is the most opaque
  const GaussianCloud made = cloud;
  const auto done = ChooseCopies(Groups(50, 4), {.merge_cost = 0}, cloud);
  ASSERT_TRUE(done.ok());
  EXPECT_EQ(done->merged, 150);
  ASSERT_EQ(cloud.size(), 50);
  EXPECT_EQ(cloud.opacity_logits[0], 2);
  EXPECT_EQ(cloud.means[0], made.means[3]);
  EXPECT_EQ(cloud.opacity_logits[49], -7);  // row 50, behind those of the others
  EXPECT_EQ(cloud.means[3 * 49], made.means[3 * 50]);
}

TEST(CopyChoice, GaussiansThatStandAloneStay) {
  GaussianCloud cloud = Copies(40, 2, 0.1);
  GaussianCloud alone = SheetCloud(10, 1, 8);
  ASSERT_TRUE(Append(cloud, alone).ok());
  ASSERT_TRUE(ChooseCopies(Groups(40, 2), {.copies = 1}, cloud).ok());
  ASSERT_EQ(cloud.size(), 50);
  EXPECT_TRUE(std::equal(alone.means.begin(), alone.means.end(), cloud.means.begin() + 120));
  EXPECT_TRUE(std::equal(alone.sh.begin(), alone.sh.end(), cloud.sh.begin() + 40 * 12));
}

// Copies, then one stand-in for those of each.
struct WithStandIns {
  GaussianCloud cloud;
  CopyGroups groups;
};
WithStandIns With(const GaussianCloud& copies, const GaussianCloud& stand_ins) {
  WithStandIns with{copies, Groups(stand_ins.size(), copies.size() / stand_ins.size())};
  EXPECT_TRUE(Append(with.cloud, stand_ins).ok());
  with.groups.stand_ins = true;
  return with;
}

// The square of the difference of the pictures over the three views along the axes, mean over these and over red, green
// and blue, by sums over pixels. Copies and the stand-in are balls around the x axis, of degree 0.
double CostOnAGrid(const GaussianCloud& cloud, int64_t copies, double less) {
  const int64_t all = copies + 1;
  std::vector<double> variance, opacity, mass;
  double mass_of_copies = 0;
  for (int64_t k = 0; k < all; ++k) {
    const double stored = Sigmoid(double{cloud.opacity_logits[static_cast<size_t>(k)]});
    const double length = std::exp(double{cloud.log_scales[static_cast<size_t>(3 * k)]}) / kClosePixel;
    variance.push_back((length * length + 0.3) * VisibleVarianceShare(stored));
    opacity.push_back((stored - 1.0 / 255) / VisibleVarianceShare(stored));
    mass.push_back(opacity.back() * variance.back());
    if (k < copies) mass_of_copies += mass.back();
  }
  std::array<double, 3> mean{};
  for (int64_t k = 0; k < copies; ++k) {
    for (size_t c = 0; c < 3; ++c) {
      mean[c] += mass[static_cast<size_t>(k)] / mass_of_copies * cloud.sh[static_cast<size_t>(3 * k) + c];
    }
  }
  double cost = 0;
  constexpr double kStep = 0.1;
  for (int view = 0; view < 3; ++view) {  // along x, where all are at one place, along y and along z
    for (double u = -12; u <= 12; u += kStep) {
      for (double v = -12; v <= 12; v += kStep) {
        double alpha = 0;
        std::array<double, 3> color{};
        for (int64_t k = 0; k < all; ++k) {
          const auto at = static_cast<size_t>(k);
          const double x = view == 0 ? 0 : (cloud.means[3 * at] - cloud.means[0]) / kClosePixel;
          const double square = (u - x) * (u - x) + v * v;
          const double a = (k < copies ? less : -1) * opacity[at] * std::exp(-0.5 * square / variance[at]);
          alpha += a;
          for (size_t c = 0; c < 3; ++c) color[c] += a * (cloud.sh[3 * at + c] - mean[c]);
        }
        for (size_t c = 0; c < 3; ++c) {
          cost += kStep * kStep / 9 * (kSh0 * kSh0 * color[c] * color[c] + kBehind * kBehind * alpha * alpha);
        }
      }
    }
  }
  return cost;
}

TEST(CopyChoice, AStandInCostsWhatThePictureChanges) {
  GaussianCloud cloud;
  cloud.Resize(4, 0);
  std::ranges::fill(cloud.means, 0.0f);
  std::ranges::fill(cloud.quats, 0.0f);
  for (size_t k = 0; k < 4; ++k) cloud.quats[4 * k] = 1;
  for (const double apart : {0.0, 0.7, 2.0}) {
    for (const double other : {0.0, 0.5}) {  // than the middle of the copies
      for (size_t k = 0; k < 4; ++k) {
        cloud.means[3 * k] = static_cast<float>(kClosePixel * (k < 3 ? apart * (double(k) - 1) : 2 * other));
        const double length = (k < 3 ? 1.2 + 0.2 * double(k) : 1.6 + other) * kClosePixel;
        for (size_t c = 0; c < 3; ++c) {
          cloud.log_scales[3 * k + c] = static_cast<float>(std::log(length));
          cloud.sh[3 * k + c] = static_cast<float>(0.3 * double(c) + (k == 1 ? 0.4 : 0) + (k == 3 ? other : 0.1));
        }
        cloud.opacity_logits[k] = k < 3 ? -1.0f : 0.5f;
      }
      CopyGroup group(3, 0);
      group.Load(cloud, 0, 1, 3, kClosePixel, /*colors=*/true);
      double before = 0;
      for (size_t k = 0; k < 3; ++k) {
        const double seen = VisibleVarianceShare(Sigmoid(-1.0));
        MergeGaussian g;
        const double length = (1.2 + 0.2 * double(k)), variance = (length * length + 0.3) * seen;
        g.covariance = {variance, 0, 0, variance, 0, variance};
        g.opacity = (Sigmoid(-1.0) - 1.0 / 255) / seen;
        Measure(g);
        before += g.mass;
      }
      while (group.alive() > 1) group.Apply(group.Next());
      const double less = group.Mass() / before;
      EXPECT_LT(less, 1);
      const double cost = group.CostOfStandIn(cloud, 3), expected = CostOnAGrid(cloud, 3, less);
      EXPECT_NEAR(cost, expected, 1e-3 * expected + 1e-6) << apart << ' ' << other;
    }
  }
}

TEST(CopyChoice, StandInsComeWhereTheyAreCheap) {
  const GaussianCloud made = Copies(500, 4, 0.2);
  GaussianCloud merged = made;
  ASSERT_TRUE(ChooseCopies(Groups(500, 4), {.copies = 1}, merged).ok());
  ASSERT_EQ(merged.size(), 500);
  GaussianCloud wrong = merged;
  for (size_t i = 0; i < wrong.sh.size(); ++i) wrong.sh[i] += 3;
  for (const double cost : {0.0, 1e-4, 1e-3, 1e-2}) {
    GaussianCloud without = made;
    ASSERT_TRUE(ChooseCopies(Groups(500, 4), {.merge_cost = cost}, without).ok());
    WithStandIns good = With(made, merged), bad = With(made, wrong);
    ASSERT_TRUE(ChooseCopies(good.groups, {.merge_cost = cost}, good.cloud).ok());
    ASSERT_TRUE(ChooseCopies(bad.groups, {.merge_cost = cost}, bad.cloud).ok());
    // What stands for all copies is counted at a part of what it costs, and so comes before the merges do, or as they.
    EXPECT_LE(good.cloud.size(), bad.cloud.size()) << cost;
    EXPECT_LE(bad.cloud.size(), without.size()) << cost;
    if (cost == 1e-2) {
      EXPECT_LT(good.cloud.size(), without.size() - 20);
      EXPECT_LT(good.cloud.size(), bad.cloud.size() - 20);
    }
  }
}

TEST(CopyChoice, WhereOneStaysItIsTheStandIn) {
  const GaussianCloud made = Copies(300, 4, 0.2), others = SheetCloud(300, 1, 9);
  for (const CopyChoice& choice :
       {CopyChoice{.merge_cost = 1e9}, CopyChoice{.merge_cost = 0, .max_gaussians = 300}, CopyChoice{.copies = 1}}) {
    WithStandIns with = With(made, others);
    ASSERT_TRUE(ChooseCopies(with.groups, choice, with.cloud).ok());
    EXPECT_TRUE(SameValues(with.cloud, others));
  }
  WithStandIns dust = With(made, others);
  dust.groups.single.assign(300, 0);
  for (size_t g = 0; g < 300; g += 3) dust.groups.single[g] = 1;
  ASSERT_TRUE(ChooseCopies(dust.groups, {.merge_cost = 0}, dust.cloud).ok());
  EXPECT_EQ(std::ranges::count(dust.cloud.means, others.means[3 * 297]), 1);
  // A budget is kept exactly.
  for (const int64_t most : {299, 301, 700, 1199}) {
    WithStandIns budget = With(made, others);
    const auto done = ChooseCopies(budget.groups, {.copies = 4, .max_gaussians = most}, budget.cloud);
    ASSERT_TRUE(done.ok());
    EXPECT_EQ(budget.cloud.size(), most);
    EXPECT_EQ(done->merged + done->left_out, 1200 - most);
  }
}

// Their appearance cannot be predicted.
TEST(CopyChoice, AStandInThatIsNoneLeavesTheCopies) {
  const GaussianCloud made = Copies(40, 4, 0.2);
  GaussianCloud broken = SheetCloud(40, 1, 9);
  for (float& x : broken.means) x = 3e38f;
  for (const CopyChoice& choice : {CopyChoice{.merge_cost = 1e-3}, CopyChoice{.merge_cost = 0, .max_gaussians = 40}}) {
    WithStandIns with = With(made, broken);
    GaussianCloud without = made;
    ASSERT_TRUE(ChooseCopies(with.groups, choice, with.cloud).ok());
    ASSERT_TRUE(ChooseCopies(Groups(40, 4), choice, without).ok());
    for (int64_t i = 0; i < with.cloud.size(); ++i) EXPECT_TRUE(IsUsable(with.cloud, i));
    if (choice.max_gaussians > 0) {
      EXPECT_EQ(with.cloud.size(), 40);
    }
  }
}

TEST(CopyChoice, OddGaussiansStayUsable) {
  GaussianCloud hostile = Copies(40, 4, 0.5);
  for (size_t i = 0; i < 160; i += 3) hostile.log_scales[3 * i] = -kInfinity;
  for (size_t i = 0; i < 3; ++i) hostile.log_scales[3 * 5 + i] = -kInfinity;
  hostile.log_scales[3 * 6] = 40;
  hostile.log_scales[3 * 7] = 44;
  hostile.log_scales[3 * 8] = -300;
  hostile.means[3 * 9] = 1e18f;
  hostile.means[3 * 49] = -1e18f;
  hostile.opacity_logits[10] = kInfinity;
  hostile.opacity_logits[50] = kInfinity;
  hostile.opacity_logits[11] = 1e30f;
  hostile.opacity_logits[12] = -kInfinity;
  std::fill_n(hostile.quats.begin() + 4 * 13, 4, 0.0f);
  hostile.sh[12 * 14] = 1e38f;
  hostile.sh[12 * 54] = -1e38f;
  for (const float pixel : {kClosePixel, 1e-38f, 1e15f}) {
    for (const int64_t copies : {1, 2}) {
      for (const int64_t most : {0, 70}) {
        GaussianCloud cloud = hostile;
        const auto done = ChooseCopies({40, 4, {pixel}}, {.copies = copies, .max_gaussians = most}, cloud);
        ASSERT_TRUE(done.ok());
        EXPECT_LE(cloud.size(), 40 * copies);
        for (int64_t i = 0; i < cloud.size(); ++i) EXPECT_TRUE(IsUsable(cloud, i)) << i << ' ' << pixel;
      }
    }
  }
}

TEST(CopyChoice, RefusesWhatHasNoMeaning) {
  GaussianCloud cloud = Copies(5, 4, 0.1);
  for (const CopyChoice& choice : {CopyChoice{.copies = 5}, CopyChoice{.copies = 0}, CopyChoice{.merge_cost = -1},
                                   CopyChoice{.merge_cost = NAN}, CopyChoice{.max_gaussians = -1}}) {
    const auto done = ChooseCopies(Groups(5, 4), choice, cloud);
    ASSERT_FALSE(done.ok());
    EXPECT_EQ(done.error().code, ErrorCode::kBadArgument);
  }
  EXPECT_EQ(cloud.size(), 20);
}

}  // namespace
}  // namespace anchorsplat
