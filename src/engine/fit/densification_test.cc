#include "fit/densification.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/parallel.h"
#include "core/rotation.h"
#include "fit/random_streams.h"
#include "formats/random_cloud_for_test.h"

namespace anchorsplat {
namespace {

constexpr int kWidth = 200, kHeight = 100;

// One Gaussian, as the reference moves it about, with the row its Adam moments came from (−1: new).
struct Row {
  float mean[3], log_scale[3], quat[4], logit, sh[12];
  float grad2d = 0, count = 0, radius = 0;
  int64_t moments = -1;
};

std::vector<Row> RowsOf(const GaussianCloud& cloud) {
  std::vector<Row> rows(static_cast<size_t>(cloud.size()));
  for (size_t i = 0; i < rows.size(); ++i) {
    std::copy_n(cloud.means.data() + 3 * i, 3, rows[i].mean);
    std::copy_n(cloud.log_scales.data() + 3 * i, 3, rows[i].log_scale);
    std::copy_n(cloud.quats.data() + 4 * i, 4, rows[i].quat);
    rows[i].logit = cloud.opacity_logits[i];
    std::copy_n(cloud.sh.data() + 12 * i, 12, rows[i].sh);
    rows[i].moments = static_cast<int64_t>(i);
  }
  return rows;
}

// gsplat's DefaultStrategy.step_post_backward, statement by statement, on a list of rows.
void Reference(const DensificationOptions& o, int64_t step, double scene_scale, uint64_t seed,
               const CloudGradient& gradient, std::vector<Row>& rows) {
  if (step >= o.refine_stop_iter) return;
  for (size_t i = 0; i < rows.size(); ++i) {
    const int32_t rx = gradient.radii[2 * i], ry = gradient.radii[2 * i + 1];
    if (rx <= 0 || ry <= 0) continue;
    const auto& grads = o.absgrad ? gradient.means2d_abs : gradient.means2d;
    const float gx = grads[2 * i] * (kWidth / 2.0f), gy = grads[2 * i + 1] * (kHeight / 2.0f);
    rows[i].grad2d += std::sqrt(gx * gx + gy * gy);
    rows[i].count += 1;
    rows[i].radius = std::max(rows[i].radius, static_cast<float>(std::max(rx, ry)) / std::max(kWidth, kHeight));
  }
  const auto largest = [](const Row& row) {
    return std::exp(double{std::max({row.log_scale[0], row.log_scale[1], row.log_scale[2]})});
  };
  if (step > o.refine_start_iter && step % o.refine_every == 0 && step % o.reset_every >= o.pause_refine_after_reset) {
    std::vector<bool> is_dupli, is_split;
    for (const Row& row : rows) {
      const bool is_grad_high = row.grad2d / std::max(row.count, 1.0f) > static_cast<float>(o.grow_grad2d);
      const bool is_small = largest(row) <= o.grow_scale3d * scene_scale;
      is_dupli.push_back(is_grad_high && is_small);
      bool split = is_grad_high && !is_small;
      if (step < o.refine_scale2d_stop_iter) split = split || row.radius > static_cast<float>(o.grow_scale2d);
      is_split.push_back(split);
    }
    const size_t n = rows.size();
    for (size_t i = 0; i < n; ++i) {  // duplicate
      if (!is_dupli[i]) continue;
      rows.push_back(rows[i]);
      rows.back().moments = -1;
      is_split.push_back(false);
    }
    std::vector<Row> rest, halves;  // split
    for (size_t i = 0; i < rows.size(); ++i) {
      if (!is_split[i]) rest.push_back(rows[i]);
    }
    Random random = RandomStream(seed, RandomPurpose::kSplit, step);
    for (int sample = 0; sample < 2; ++sample) {
      for (size_t i = 0; i < rows.size(); ++i) {
        if (!is_split[i]) continue;
        Row half = rows[i];
        half.moments = -1;
        const auto r = RotationFromQuaternion(half.quat[0], half.quat[1], half.quat[2], half.quat[3]);
        float v[3];
        for (size_t a = 0; a < 3; ++a) v[a] = std::exp(half.log_scale[a]) * static_cast<float>(random.Normal());
        for (size_t a = 0; a < 3; ++a) {
          half.mean[a] += r[3 * a] * v[0] + r[3 * a + 1] * v[1] + r[3 * a + 2] * v[2];
          half.log_scale[a] = static_cast<float>(std::log(std::exp(double{rows[i].log_scale[a]}) / 1.6));
        }
        if (o.revised_opacity) {
          const double opacity = 1 - std::sqrt(1 - 1 / (1 + std::exp(-double{half.logit})));
          half.logit = static_cast<float>(std::log(opacity / (1 - opacity)));
        }
        halves.push_back(half);
      }
    }
    rows = rest;
    rows.insert(rows.end(), halves.begin(), halves.end());
    std::erase_if(rows, [&](const Row& row) {  // prune
      bool is_prune = 1 / (1 + std::exp(-double{row.logit})) < o.prune_opa;
      if (step > o.reset_every) {
        bool is_too_big = largest(row) > o.prune_scale3d * scene_scale;
        if (step < o.refine_scale2d_stop_iter) {
          is_too_big = is_too_big || row.radius > static_cast<float>(o.prune_scale2d);
        }
        is_prune = is_prune || is_too_big;
      }
      return is_prune;
    });
    for (Row& row : rows) row.grad2d = row.count = row.radius = 0;
  }
  const bool reset = o.opacity_reset != OpacityReset::kNever && step % o.reset_every == 0;
  if (reset && (step > 0 || o.opacity_reset == OpacityReset::kFromZero)) {
    for (Row& row : rows) row.logit = std::min(row.logit, static_cast<float>(std::log(0.01 / 0.99)));
  }
}

struct Scene {
  GaussianCloud cloud;
  CloudOptimizer optimizer;  // moments of row i are i + 1
  CloudGradient gradient;
};

Scene RandomScene(int64_t n, uint64_t seed) {
  Scene s;
  s.cloud = RandomCloud(n, 1, seed);
  Random random(seed + 1);
  for (float& x : s.cloud.log_scales) x = static_cast<float>(random.Uniform(-8, 0.5));
  for (float& x : s.cloud.opacity_logits) x = static_cast<float>(random.Uniform(-8, 3));
  s.optimizer = CloudOptimizer(s.cloud);
  for (auto& m : s.optimizer.moments()) {
    for (size_t i = 0; i < m.first.size(); ++i) {
      m.first[i] = m.second[i] = static_cast<float>(i / static_cast<size_t>(m.width) + 1);
    }
  }
  for (int64_t i = 0; i < 2 * n; ++i) {
    s.gradient.means2d.push_back(static_cast<float>(random.Normal() * 4e-6));
    s.gradient.radii.push_back(random.Uniform() < 0.2 ? 0 : static_cast<int32_t>(random.Below(45)));
  }
  for (int64_t i = 0; i < 2 * n; ++i) {
    s.gradient.means2d_abs.push_back(static_cast<float>(std::abs(random.Normal()) * 12e-6));
  }
  return s;
}

void ExpectSame(const Scene& s, const Densification& densification, const std::vector<Row>& expected) {
  ASSERT_TRUE(Validate(s.cloud).ok());
  ASSERT_EQ(s.cloud.size(), static_cast<int64_t>(expected.size()));
  for (size_t i = 0; i < expected.size(); ++i) {
    const Row& row = expected[i];
    for (size_t a = 0; a < 3; ++a) {
      ASSERT_NEAR(s.cloud.means[3 * i + a], row.mean[a], 1e-5) << i;
      ASSERT_NEAR(s.cloud.log_scales[3 * i + a], row.log_scale[a], 1e-5) << i;
    }
    for (size_t a = 0; a < 4; ++a) ASSERT_EQ(s.cloud.quats[4 * i + a], row.quat[a]) << i;
    ASSERT_NEAR(s.cloud.opacity_logits[i], row.logit, 1e-4) << i;
    for (size_t a = 0; a < 12; ++a) ASSERT_EQ(s.cloud.sh[12 * i + a], row.sh[a]) << i;
    ASSERT_NEAR(densification.gathered().grad2d[i], row.grad2d, 1e-9) << i;
    ASSERT_EQ(densification.gathered().count[i], row.count) << i;
    ASSERT_EQ(densification.gathered().radii[i], row.radius) << i;
    for (const auto& m : s.optimizer.moments()) {
      const auto k = i * static_cast<size_t>(m.width);
      ASSERT_EQ(m.first[k], static_cast<float>(row.moments + 1)) << m.attribute << i;
      ASSERT_EQ(m.second[k + static_cast<size_t>(m.width) - 1], static_cast<float>(row.moments + 1)) << i;
    }
  }
}

// Runs both over `steps` and compares after each.
void ExpectMatchesReference(const DensificationOptions& options, const std::vector<int64_t>& steps, uint64_t seed) {
  constexpr double kSceneScale = 1.7;
  Scene s = RandomScene(300, seed);
  std::vector<Row> expected = RowsOf(s.cloud);
  Densification densification(s.cloud.size());
  for (const int64_t step : steps) {
    Reference(options, step, kSceneScale, seed, s.gradient, expected);
    const DensificationChange change =
        densification.AfterStep(options, step, kSceneScale, seed, kWidth, kHeight, s.gradient, s.cloud);
    s.optimizer.Apply(change.rows);
    if (change.resets_opacities) CapOpacities(s.cloud, 2 * options.prune_opa);
    ExpectSame(s, densification, expected);
    if (testing::Test::HasFatalFailure()) return;
    // The picture of the next step: gradients for the rows there are now.
    const Scene next = RandomScene(s.cloud.size(), seed + static_cast<uint64_t>(step) + 7);
    s.gradient = next.gradient;
  }
}

TEST(Densification, MatchesReference) {
  for (const uint64_t seed : {1, 2, 3}) {
    ExpectMatchesReference(ScaledTo({}, 30000), {0, 1, 500, 599, 600, 601, 700, 3000, 3100, 14900, 15000, 15100}, seed);
    DensificationOptions options;
    options.opacity_reset = OpacityReset::kFromZero;
    options.revised_opacity = true;
    ExpectMatchesReference(ScaledTo(options, 15000), {0, 249, 250, 300, 350, 1500, 1550, 7450, 7500}, seed);
  }
}

TEST(Densification, MatchesReferenceWithTheRulesThatAreOffByDefault) {
  for (const uint64_t seed : {4, 5}) {
    DensificationOptions options;
    options.refine_scale2d_stop_iter = 4000;
    options.pause_refine_after_reset = 150;
    options.opacity_reset = OpacityReset::kNever;
    ExpectMatchesReference(options, {599, 600, 3000, 3100, 3200, 3300, 4100}, seed);
  }
}

TEST(Densification, MatchesReferenceWithAbsoluteGradients) {
  for (const uint64_t seed : {6, 7}) {
    DensificationOptions options;
    options.absgrad = true;
    options.grow_grad2d = kAbsgradGrowGrad2d;
    ExpectMatchesReference(options, {0, 1, 599, 600, 601, 700, 3000, 3100}, seed);
  }
}

TEST(Densification, ScheduleIsGsplatsForTheStepsScaler) {
  const DensificationOptions half = ScaledTo({}, 15000), small = ScaledTo({}, 7000), tiny = ScaledTo({}, 10);
  EXPECT_EQ(half.refine_start_iter, 250);
  EXPECT_EQ(half.refine_stop_iter, 7500);
  EXPECT_EQ(half.refine_every, 50);
  EXPECT_EQ(half.reset_every, 1500);
  EXPECT_EQ(small.refine_stop_iter, 3500);
  EXPECT_EQ(small.refine_every, 23);
  EXPECT_EQ(tiny.refine_every, 1);
  EXPECT_EQ(tiny.reset_every, 1);
}

TEST(Densification, OpacityResetFollowsTheVersion) {
  const auto first_logit = [](OpacityReset reset, int64_t step) {
    Scene s = RandomScene(1, 1);
    s.cloud.opacity_logits[0] = 2;
    DensificationOptions options;
    options.opacity_reset = reset;
    Densification densification(1);
    const auto change = densification.AfterStep(options, step, 1, 1, kWidth, kHeight, s.gradient, s.cloud);
    if (change.resets_opacities) CapOpacities(s.cloud, 2 * options.prune_opa);
    return s.cloud.opacity_logits[0];
  };
  const auto one_percent = static_cast<float>(std::log(0.01 / 0.99));
  EXPECT_EQ(first_logit(OpacityReset::kPositive, 0), 2);
  EXPECT_EQ(first_logit(OpacityReset::kPositive, 3000), one_percent);
  EXPECT_EQ(first_logit(OpacityReset::kFromZero, 0), one_percent);
  EXPECT_EQ(first_logit(OpacityReset::kFromZero, 3000), one_percent);
  EXPECT_EQ(first_logit(OpacityReset::kNever, 0), 2);
  EXPECT_EQ(first_logit(OpacityReset::kNever, 3000), 2);
  EXPECT_EQ(first_logit(OpacityReset::kPositive, 15000), 2) << "no reset after refinement has stopped";
}

TEST(Densification, GrowthStopsAtTheCapWithTheLargestGradientsFirst) {
  Scene s = RandomScene(20, 3);
  for (int64_t i = 0; i < 20; ++i) {
    s.gradient.means2d[static_cast<size_t>(2 * i)] = 1e-4f * static_cast<float>((i * 7) % 20 + 1);
    s.gradient.means2d[static_cast<size_t>(2 * i + 1)] = 0;
    s.gradient.radii[static_cast<size_t>(2 * i)] = s.gradient.radii[static_cast<size_t>(2 * i + 1)] = 3;
  }
  std::fill(s.cloud.opacity_logits.begin(), s.cloud.opacity_logits.end(), 1.0f);
  std::fill(s.cloud.log_scales.begin(), s.cloud.log_scales.end(), -7.0f);
  for (size_t a = 0; a < 3; ++a) s.cloud.log_scales[3 * 17 + a] = -2;  // row 17 has the largest gradient, and is split
  DensificationOptions options;
  options.max_gaussians = 23;
  const GaussianCloud before = s.cloud;
  Densification densification(20);
  const auto change = densification.AfterStep(options, 600, 1, 1, kWidth, kHeight, s.gradient, s.cloud);
  EXPECT_EQ(s.cloud.size(), 23);
  EXPECT_EQ(change.duplicated, 2);
  EXPECT_EQ(change.split, 1);
  EXPECT_EQ(change.rows.fresh, 4);
  // (i·7 mod 20) is 19 for row 17, 18 for row 14, 17 for row 11; duplicates come in the order of rows.
  EXPECT_EQ(s.cloud.means[3 * 19], before.means[3 * 11]);
  EXPECT_EQ(s.cloud.means[3 * 20], before.means[3 * 14]);
  EXPECT_EQ(s.cloud.opacity_logits.back(), 1);
  options.max_gaussians = 5;
  const auto none = densification.AfterStep(options, 700, 1, 1, kWidth, kHeight, RandomScene(23, 1).gradient, s.cloud);
  EXPECT_FALSE(none.rows.any) << "a bound below what is there takes nothing away";
}

TEST(Densification, RowsThatAreNotFiniteGo) {
  Scene s = RandomScene(5, 3);
  std::fill(s.cloud.opacity_logits.begin(), s.cloud.opacity_logits.end(), 1.0f);
  std::fill(s.gradient.means2d.begin(), s.gradient.means2d.end(), 0.0f);
  s.cloud.opacity_logits[1] = NAN;
  s.cloud.sh[12 * 3 + 5] = INFINITY;
  Densification densification(5);
  const auto change = densification.AfterStep({}, 600, 1, 1, kWidth, kHeight, s.gradient, s.cloud);
  EXPECT_EQ(change.pruned, 2);
  EXPECT_EQ(std::vector<int64_t>(change.rows.kept.begin(), change.rows.kept.end()), (std::vector<int64_t>{0, 2, 4}));
}

TEST(Densification, NoGaussiansAndAllPruned) {
  GaussianCloud empty;
  CloudGradient gradient;
  Densification none(0);
  EXPECT_FALSE(none.AfterStep({}, 600, 1, 1, kWidth, kHeight, gradient, empty).rows.any);
  Scene s = RandomScene(40, 3);
  std::fill(s.cloud.opacity_logits.begin(), s.cloud.opacity_logits.end(), -9.0f);
  Densification densification(40);
  const auto change = densification.AfterStep({}, 600, 1, 1, kWidth, kHeight, s.gradient, s.cloud);
  s.optimizer.Apply(change.rows);
  EXPECT_EQ(s.cloud.size(), 0);
  EXPECT_TRUE(s.optimizer.moments()[0].first.empty());
}

TEST(Densification, SameBitsForAnyNumberOfThreads) {
  GaussianCloud expected;
  for (const int threads : {1, 2, 5}) {
    SetThreadCount(threads);
    Scene s = RandomScene(20000, 3);
    Densification densification(s.cloud.size());
    (void)densification.AfterStep({}, 600, 1, 1, kWidth, kHeight, s.gradient, s.cloud);
    if (threads == 1) expected = s.cloud;
    ExpectSameCloud(s.cloud, expected);
  }
  SetThreadCount(0);
}

}  // namespace
}  // namespace anchorsplat
