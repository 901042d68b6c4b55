#include "train/merged_copies.h"

#include <gtest/gtest.h>

#include <cmath>

#include "compact/choose_copies_for_test.h"
#include "compact/sheet_cloud_for_test.h"
#include "core/random.h"

namespace anchorsplat {
namespace {

constexpr float kPixel = kSheetPixel / 4;

// Copies of each Gaussian of a sheet, a little different from each other.
GaussianCloud Copies(int64_t count, int64_t copies, double different) {
  const GaussianCloud sheet = SheetCloud(count, 1);
  GaussianCloud cloud;
  for (int64_t k = 0; k < copies; ++k) EXPECT_TRUE(Append(cloud, sheet).ok());
  Random random(3);
  const auto change = [&](Buffer<float>& values, double by) {
    for (float& x : values) x += static_cast<float>(by * different * random.Normal());
  };
  change(cloud.means, kSheetPixel);
  change(cloud.log_scales, 1);
  change(cloud.quats, 0.3);
  change(cloud.sh, 1);
  for (float& x : cloud.opacity_logits) x = static_cast<float>(-1 + different * random.Normal());
  return cloud;
}

MergeRule Rule(int64_t count, int64_t copies, double cost, RenderMode mode = RenderMode::kClassic) {
  return {.copies = copies, .pixel_sizes = torch::full({count}, kPixel), .mode = mode, .cost = cost};
}

GaussianTensors WithGradients(const GaussianCloud& cloud) {
  GaussianTensors all = ToTensors(cloud);
  for (torch::Tensor* t : {&all.means, &all.log_scales, &all.quats, &all.opacity_logits, &all.sh}) {
    t->requires_grad_(true);
  }
  return all;
}

TEST(MergedCopies, AreThoseThatEnhanceLeaves) {
  const int64_t count = 200;
  for (const RenderMode mode : {RenderMode::kClassic, RenderMode::kAntialiased}) {
    GaussianCloud expected = Copies(count, 4, 0.15);
    expected.render_mode = mode;
    const GaussianTensors all = ToTensors(expected);
    ASSERT_TRUE(ChooseCopies({count, 4, {kPixel}}, {.merge_cost = 1e-3}, expected).ok());
    ASSERT_LT(expected.size(), 750);
    ASSERT_GT(expected.size(), 250);
    const GaussianTensors merged = MergedCopies(all, Rule(count, 4, 1e-3, mode));
    ASSERT_EQ(merged.size(), expected.size());
    // The same rows in another order.
    const GaussianTensors truth = ToTensors(expected);
    const auto in_order = [](const GaussianTensors& g, const torch::Tensor& of) {
      return of.index_select(0, (g.means.sum(1) + g.log_scales.sum(1)).argsort());
    };
    EXPECT_TRUE(in_order(merged, merged.means).equal(in_order(truth, truth.means)));
    EXPECT_TRUE(in_order(merged, merged.log_scales).equal(in_order(truth, truth.log_scales)));
    EXPECT_TRUE(in_order(merged, merged.quats).equal(in_order(truth, truth.quats)));
    EXPECT_TRUE(in_order(merged, merged.opacity_logits).equal(in_order(truth, truth.opacity_logits)));
    EXPECT_TRUE(in_order(merged, merged.sh).equal(in_order(truth, truth.sh)));
  }
}

TEST(MergedCopies, WhatCostsTooMuchIsNotTouched) {
  const GaussianTensors all = WithGradients(Copies(50, 4, 0.5));
  const GaussianTensors merged = MergedCopies(all, Rule(50, 4, 0));
  EXPECT_EQ(merged.size(), 200);
  EXPECT_TRUE(merged.means.equal(all.means));
}

// What nobody sees goes and has no gradient; of the others all do.
TEST(MergedCopies, GradientsReachAllButTheInvisible) {
  GaussianCloud cloud = Copies(20, 2, 0.05);
  cloud.opacity_logits[20] = -12;  // the second copy of the first
  const GaussianTensors all = WithGradients(cloud);
  const GaussianTensors merged = MergedCopies(all, Rule(20, 2, 1));
  ASSERT_EQ(merged.size(), 20);
  (merged.means.sum() + merged.log_scales.sum() + merged.quats.square().sum() + merged.opacity_logits.sum() +
   merged.sh.sum())
      .backward();
  for (const torch::Tensor& t : {all.means, all.log_scales, all.opacity_logits, all.sh}) {
    ASSERT_TRUE(t.grad().isfinite().all().item<bool>());
    const torch::Tensor rows = t.grad().view({40, -1}).abs().sum(1);
    for (int64_t row = 0; row < 40; ++row) {
      if (row == 20) {
        EXPECT_EQ(rows[row].item<float>(), 0);
      } else {
        EXPECT_GT(rows[row].item<float>(), 0) << row;
      }
    }
  }
}

// What is seen of a cloud that no turning, order or sign of axes changes: masses' sum, mean and second moment,
// weighted.
torch::Tensor Seen(const GaussianTensors& g) {
  const torch::Tensor q = g.quats / g.quats.norm(2, 1, true);
  const torch::Tensor w = q.select(1, 0), x = q.select(1, 1), y = q.select(1, 2), z = q.select(1, 3);
  const torch::Tensor turn = torch::stack({1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
                                           2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                                           2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)},
                                          1)
                                 .view({-1, 3, 3});
  const torch::Tensor sides = turn * (g.log_scales.exp() / kPixel).unsqueeze(1);
  const torch::Tensor covariance = sides.matmul(sides.transpose(1, 2));
  const torch::Tensor weights = torch::tensor({1.0F, 0.3F, -0.5F, 0.2F, 0.7F, 0.4F, -0.1F, 0.6F, 0.9F}).view({3, 3});
  const torch::Tensor opacity = torch::sigmoid(g.opacity_logits);
  return (opacity * ((covariance * weights).sum({1, 2}) + (g.means / kPixel).sum(1).sin() + g.sh.sum({1, 2}))).sum();
}

// Against differences of the merge itself, which besides knows what copies share and the limit of 1/255.
TEST(MergedCopies, GradientIsThatOfTheMergeToFirstOrder) {
  const int64_t count = 40;
  GaussianTensors all = WithGradients(Copies(count, 4, 0.1));
  // One of four for all: the same groups however the values change.
  const MergeRule rule = Rule(count, 4, 1e9);
  ASSERT_EQ(MergedCopies(all, rule).size(), count);
  Seen(MergedCopies(all, rule)).backward();
  const torch::NoGradGuard no_gradient;
  struct Checked {
    torch::Tensor GaussianTensors::*values;
    double unit;  // of a change
    double share;
  };
  for (const Checked& checked :
       {Checked{&GaussianTensors::means, kPixel, 0.2}, Checked{&GaussianTensors::log_scales, 1, 0.2},
        Checked{&GaussianTensors::quats, 1, 0.1}, Checked{&GaussianTensors::opacity_logits, 1, 0.2},
        Checked{&GaussianTensors::sh, 1, 0.05}}) {
    const torch::Tensor values = all.*checked.values;
    const torch::Tensor gradient = values.grad();
    torch::manual_seed(5);
    for (int trial = 0; trial < 3; ++trial) {
      // Towards the gradient and a little aside.
      torch::Tensor direction =
          gradient / gradient.norm() + 0.5 * torch::randn_like(gradient) / std::sqrt(gradient.numel());
      direction = direction / direction.norm() * checked.unit;
      const double step = 0.01;
      GaussianTensors there = all, back = all;
      there.*checked.values = values + step * direction;
      back.*checked.values = values - step * direction;
      const double difference =
          (Seen(MergedCopies(there, rule)) - Seen(MergedCopies(back, rule))).item<double>() / (2 * step);
      const double told = (gradient * direction).sum().item<double>();
      EXPECT_NEAR(told, difference, checked.share * std::abs(difference)) << checked.unit << ' ' << trial;
    }
  }
}

}  // namespace
}  // namespace anchorsplat
