#include "fit/mcmc.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/activations.h"
#include "core/parallel.h"
#include "core/rotation.h"
#include "fit/cloud_optimizer.h"
#include "fit/regularizers.h"
#include "formats/random_cloud_for_test.h"
#include "render/rasterizer.h"

namespace anchorsplat {
namespace {

double Binomial(int64_t n, int64_t k) {
  double value = 1;
  for (int64_t i = 1; i <= k; ++i) value = value * static_cast<double>(n - k + i) / static_cast<double>(i);
  return std::round(value);
}

// Eq. 9 of Kheradmand et al. 2024 as it is written.
Relocation PaperRelocation(double opacity, int64_t n) {
  const double shared = 1 - std::pow(1 - opacity, 1 / static_cast<double>(n));
  double sum = 0;
  for (int64_t i = 1; i <= n; ++i) {
    for (int64_t k = 0; k <= i - 1; ++k) {
      sum += Binomial(i - 1, k) * std::pow(-1.0, k) * std::pow(shared, k + 1) / std::sqrt(k + 1.0);
    }
  }
  return {shared, opacity / sum};
}

TEST(Mcmc, RelocationIsThePapers) {
  for (const double opacity : {0.01, 0.1, 0.5, 0.9, 0.99}) {
    for (const int64_t ratio : {1, 2, 3, 7, 20, 51}) {
      const Relocation expected = PaperRelocation(opacity, ratio), found = RelocationOf(opacity, ratio, 1e-9);
      EXPECT_NEAR(found.opacity, expected.opacity, 1e-12) << opacity << " " << ratio;
      EXPECT_NEAR(found.scale, expected.scale, 1e-9) << opacity << " " << ratio;
    }
  }
  EXPECT_DOUBLE_EQ(RelocationOf(0.7, 1, 1e-9).scale, 1);  // alone it stays what it is
}

TEST(Mcmc, RelocationIsBounded) {
  EXPECT_EQ(RelocationOf(0.8, 1000, 0.005).opacity, RelocationOf(0.8, kMostRelocated, 0.005).opacity);
  EXPECT_EQ(RelocationOf(0.01, 10, 0.005).opacity, 0.005);
  for (const int64_t ratio : {2, 51}) {  // opaque ones, where the terms of the sum are larger than it by 10^14
    const Relocation opaque = RelocationOf(1, ratio, 0.005);
    EXPECT_EQ(opaque.opacity, 1 - double{std::numeric_limits<float>::epsilon()});
    EXPECT_GT(opaque.scale, 0.3);
    EXPECT_LT(opaque.scale, 1);
  }
}

// What it is for: N in one place look like the one before, in the middle and all over.
TEST(Mcmc, RelocatedGaussiansKeepTheLook) {
  const auto picture = [](const GaussianCloud& cloud) {
    Camera camera;
    camera.intrinsics = {48, 48, 60, 60, 24, 24};
    RenderOptions options;
    options.dilation = 1e-4f;  // which every Gaussian has and no formula knows
    options.min_alpha = 1e-6f;
    Rasterizer rasterizer;
    RenderOutput output;
    EXPECT_TRUE(rasterizer.Render(cloud, camera, options, output).ok());
    return output.color;
  };
  const auto copies = [](double opacity, double scale, int64_t n) {
    GaussianCloud cloud;
    cloud.Resize(n, 0);
    for (size_t i = 0; i < static_cast<size_t>(n); ++i) {
      cloud.means[3 * i] = cloud.means[3 * i + 1] = 0;
      cloud.means[3 * i + 2] = 3;
      std::fill_n(&cloud.log_scales[3 * i], 3, static_cast<float>(std::log(scale)));
      cloud.quats[4 * i] = 1;
      std::fill_n(&cloud.quats[4 * i + 1], 3, 0.0f);
      cloud.opacity_logits[i] = static_cast<float>(std::log(opacity / (1 - opacity)));
      std::fill_n(&cloud.sh[3 * i], 3, 1.0f);
    }
    return cloud;
  };
  constexpr double kScale = 0.25, kOpacity = 0.8;
  const Image before = picture(copies(kOpacity, kScale, 1));
  for (const int64_t n : {2, 5}) {
    const Relocation r = RelocationOf(kOpacity, n, 0.005);
    const Image after = picture(copies(r.opacity, kScale * r.scale, n)), naive = picture(copies(kOpacity, kScale, n));
    EXPECT_NEAR(after.at(0, 24, 24), before.at(0, 24, 24), 0.01);
    double row_before = 0, row_after = 0, worst = 0, worst_naive = 0;
    for (int x = 0; x < 48; ++x) {
      row_before += before.at(0, 24, x);
      row_after += after.at(0, 24, x);
      worst = std::max(worst, std::abs(double{after.at(0, 24, x)} - before.at(0, 24, x)));
      worst_naive = std::max(worst_naive, std::abs(double{naive.at(0, 24, x)} - before.at(0, 24, x)));
    }
    EXPECT_NEAR(row_after, row_before, 0.01 * row_before) << "the sum along a line is what eq. 9 keeps";
    EXPECT_LT(worst, 0.06);
    EXPECT_GT(worst_naive, 4 * worst);
  }
}

GaussianCloud SomeCloud(int64_t n, uint64_t seed) {
  GaussianCloud cloud = RandomCloud(n, 1, seed);
  Random random(seed);
  for (float& x : cloud.log_scales) x = static_cast<float>(random.Uniform(-4, -1));
  for (float& x : cloud.opacity_logits) x = static_cast<float>(random.Uniform(-8, 4));
  return cloud;
}

constexpr McmcOptions kQuiet = {.noise_lr = 0};

TEST(Mcmc, TheDeadMoveToTheLiving) {
  const GaussianCloud before = SomeCloud(400, 3);
  GaussianCloud cloud = before;
  cloud.means[3 * 7] = std::numeric_limits<float>::quiet_NaN();  // no place to be, and dead as well
  McmcOptions options = kQuiet;
  options.cap_max = 400;  // nobody is born
  const DensificationChange change = McmcAfterStep(options, {.step = 600, .seed = 1}, cloud);
  ASSERT_EQ(cloud.size(), 400);
  EXPECT_FALSE(change.rows.any);
  int64_t dead = 0, sources = 0;
  std::vector<int64_t> forgotten;
  std::vector<int64_t> followers(400, 0);
  const auto is_dead = [&](size_t i) { return i == 7 || Sigmoid(double{before.opacity_logits[i]}) <= 0.005; };
  for (size_t i = 0; i < 400; ++i) {
    if (!is_dead(i)) continue;
    ++dead;
    // It stands exactly where one of the living does, and is its equal.
    size_t at = 0;
    while (at < 400 && (is_dead(at) || !std::equal(&cloud.means[3 * i], &cloud.means[3 * i] + 3, &cloud.means[3 * at])))
      ++at;
    ASSERT_LT(at, 400u) << i;
    ++followers[at];
    EXPECT_EQ(cloud.opacity_logits[i], cloud.opacity_logits[at]);
    EXPECT_TRUE(std::equal(&cloud.log_scales[3 * i], &cloud.log_scales[3 * i] + 3, &cloud.log_scales[3 * at]));
    EXPECT_TRUE(std::equal(&cloud.quats[4 * i], &cloud.quats[4 * i] + 4, &cloud.quats[4 * at]));
    EXPECT_TRUE(std::equal(&cloud.sh[12 * i], &cloud.sh[12 * i] + 12, &cloud.sh[12 * at]));
  }
  for (size_t i = 0; i < 400; ++i) {
    if (is_dead(i) || followers[i] > 0) forgotten.push_back(static_cast<int64_t>(i));
    if (is_dead(i)) continue;
    sources += followers[i] > 0;
    const Relocation r = RelocationOf(Sigmoid(double{before.opacity_logits[i]}), followers[i] + 1, 0.005);
    EXPECT_NEAR(Sigmoid(double{cloud.opacity_logits[i]}), r.opacity, 1e-6) << i;
    EXPECT_NEAR(cloud.log_scales[3 * i], before.log_scales[3 * i] + std::log(r.scale), 1e-5) << i;
  }
  EXPECT_GT(dead, 50);
  EXPECT_GT(sources, 50);
  EXPECT_EQ(change.relocated, dead);
  EXPECT_EQ(std::vector<int64_t>(change.forgotten.begin(), change.forgotten.end()), forgotten);
}

TEST(Mcmc, PlacesAreDrawnByOpacity) {
  constexpr int64_t kDead = 20000;
  GaussianCloud cloud = SomeCloud(kDead + 3, 4);
  std::fill(cloud.opacity_logits.begin(), cloud.opacity_logits.end(), -9.0f);
  const double opacities[] = {0.1, 0.3, 0.6};
  for (size_t i = 0; i < 3; ++i) {
    cloud.opacity_logits[i] = static_cast<float>(std::log(opacities[i] / (1 - opacities[i])));
    cloud.means[3 * i] = static_cast<float>(i) + 100;
  }
  McmcOptions options = kQuiet;
  options.cap_max = 1;
  McmcAfterStep(options, {.step = 600, .seed = 1}, cloud);
  for (size_t i = 0; i < 3; ++i) {
    int64_t here = 0;
    for (size_t k = 0; k < static_cast<size_t>(cloud.size()); ++k) here += cloud.means[3 * k] == cloud.means[3 * i];
    EXPECT_NEAR(static_cast<double>(here) / kDead, opacities[i], 0.02) << i;
  }
}

TEST(Mcmc, GrowsByAShareUpToTheCap) {
  GaussianCloud cloud = SomeCloud(200, 5);
  for (float& logit : cloud.opacity_logits) logit = 1;
  CloudOptimizer optimizer(cloud);
  McmcOptions options = kQuiet;
  options.cap_max = 225;
  std::vector<int64_t> sizes;
  for (int64_t step = 0; step <= 1200; step += 100) {
    const DensificationChange change = McmcAfterStep(options, {.step = step, .seed = 1}, cloud);
    optimizer.Apply(change.rows);
    EXPECT_EQ(change.rows.fresh, change.added);
    EXPECT_EQ(optimizer.moments()[3].first.size(), static_cast<size_t>(cloud.size()));
    sizes.push_back(cloud.size());
  }
  // Not before 600; 210 and 220 are 5 % more, rounded down.
  EXPECT_EQ(sizes, (std::vector<int64_t>{200, 200, 200, 200, 200, 200, 210, 220, 225, 225, 225, 225, 225}));
  EXPECT_TRUE(Validate(cloud).ok());
  options.cap_max = 100;  // a start above it stays
  McmcAfterStep(options, {.step = 600, .seed = 1}, cloud);
  EXPECT_EQ(cloud.size(), 225);
  options.cap_max = 1000;
  McmcAfterStep(options, {.step = 25000, .seed = 1}, cloud);
  EXPECT_EQ(cloud.size(), 225) << "growth has stopped";
}

TEST(Mcmc, AFewGrowByOne) {
  GaussianCloud cloud = SomeCloud(3, 5);
  for (float& logit : cloud.opacity_logits) logit = 1;
  McmcOptions options = kQuiet;
  options.cap_max = 6;
  std::vector<int64_t> sizes;
  for (int64_t step = 600; step <= 1000; step += 100) {
    EXPECT_LE(McmcAfterStep(options, {.step = step, .seed = 1}, cloud).added, 1);
    sizes.push_back(cloud.size());
  }
  EXPECT_EQ(sizes, (std::vector<int64_t>{4, 5, 6, 6, 6}));
}

TEST(Mcmc, NoiseFollowsSeedAndStepAndNotTheThreads) {
  const GaussianCloud before = SomeCloud(10000, 6);
  const McmcStep step = {.step = 17, .means_rate = 1e-4, .seed = 1};
  const auto after = [&](const McmcStep& s) {
    GaussianCloud cloud = before;
    EXPECT_FALSE(McmcAfterStep({}, s, cloud).rows.any);
    return cloud.means;
  };
  const Buffer<float> expected = after(step);
  EXPECT_NE(expected, before.means);
  for (const int threads : {1, 2, 5}) {
    SetThreadCount(threads);
    EXPECT_EQ(after(step), expected) << threads;
  }
  SetThreadCount(0);
  McmcStep other = step;
  other.step = 18;
  EXPECT_NE(after(other), expected);
  other = step;
  other.seed = 2;
  EXPECT_NE(after(other), expected);
}

// Its spread is that of Σ·η times the gate and the rate: s² along each axis, and nothing for what is opaque.
TEST(Mcmc, NoiseLiesAlongTheCovariance) {
  constexpr int64_t kCount = 40000;
  GaussianCloud cloud;
  cloud.Resize(kCount, 0);
  std::fill(cloud.means.begin(), cloud.means.end(), 0.0f);
  const double scales[] = {0.5, 0.2, 0.05}, opacity = 0.01;
  for (size_t i = 0; i < static_cast<size_t>(kCount); ++i) {
    for (size_t a = 0; a < 3; ++a) cloud.log_scales[3 * i + a] = static_cast<float>(std::log(scales[a]));
    const float quat[] = {0.7f, -0.4f, 1.1f, 0.3f};
    std::copy_n(quat, 4, &cloud.quats[4 * i]);
    cloud.opacity_logits[i] = i == 0 ? 3.0f : static_cast<float>(std::log(opacity / (1 - opacity)));
  }
  constexpr double kRate = 2e-6, kUnit = 2;
  McmcAfterStep({}, {.step = 0, .means_rate = kRate, .unit = kUnit, .seed = 1}, cloud);
  for (size_t a = 0; a < 3; ++a) EXPECT_EQ(cloud.means[a], 0.0f);
  const double gate = 1 / (1 + std::exp(-100 * (0.99 - 0.995)));
  const auto r = RotationFromQuaternion<double>(0.7, -0.4, 1.1, 0.3);
  for (size_t axis = 0; axis < 3; ++axis) {
    double sum = 0;
    for (size_t i = 1; i < static_cast<size_t>(kCount); ++i) {
      double along = 0;
      for (size_t a = 0; a < 3; ++a) along += r[3 * a + axis] * cloud.means[3 * i + a];
      sum += along * along;
    }
    const double expected = scales[axis] * scales[axis] * gate * kRate * 5e5 / (kUnit * kUnit);
    EXPECT_NEAR(std::sqrt(sum / (kCount - 1)), expected, 0.02 * expected) << axis;
  }
}

TEST(Mcmc, EdgesAreHarmless) {
  GaussianCloud empty;
  empty.Resize(0, 1);
  EXPECT_FALSE(McmcAfterStep({}, {.step = 600}, empty).rows.any);
  GaussianCloud all_dead = SomeCloud(50, 7);
  for (float& logit : all_dead.opacity_logits) logit = -std::numeric_limits<float>::infinity();
  const GaussianCloud before = all_dead;
  const DensificationChange change = McmcAfterStep(kQuiet, {.step = 600}, all_dead);
  EXPECT_EQ(change.relocated, 0);
  EXPECT_EQ(all_dead.size(), 50);
  EXPECT_EQ(all_dead.means, before.means);
  GaussianCloud extreme = SomeCloud(50, 8);
  for (float& logit : extreme.opacity_logits) logit = std::numeric_limits<float>::infinity();
  std::fill_n(extreme.quats.begin(), 40, 0.0f);
  McmcAfterStep({}, {.step = 600, .means_rate = 1e-4}, extreme);
  EXPECT_EQ(extreme.size(), 52);
  for (const float x : extreme.means) EXPECT_TRUE(std::isfinite(x));
}

TEST(Mcmc, ScheduleFollowsTheSteps) {
  const McmcOptions half = ScaledTo(McmcOptions{}, 15000), tiny = ScaledTo(McmcOptions{}, 10);
  EXPECT_EQ(half.refine_start_iter, 250);
  EXPECT_EQ(half.refine_stop_iter, 12500);
  EXPECT_EQ(half.refine_every, 50);
  EXPECT_EQ(tiny.refine_every, 1);
  EXPECT_EQ(half.cap_max, 1'000'000);
  EXPECT_EQ(half.noise_lr, 5e5);
}

TEST(Regularizers, MatchDifferenceQuotients) {
  GaussianCloud cloud = SomeCloud(30, 9);
  const Regularizers regularizers = {.opacity_reg = 0.3, .scale_reg = 0.7};
  constexpr double kUnit = 2.5;
  const auto loss = [&] {
    double opacities = 0, sizes = 0;
    for (const float logit : cloud.opacity_logits) opacities += Sigmoid(double{logit});
    for (const float s : cloud.log_scales) sizes += std::exp(double{s}) / kUnit;
    return 0.3 * opacities / 30 + 0.7 * sizes / 90;
  };
  CloudGradient gradient;
  gradient.opacity_logits.assign(30, 1.0f);  // it is added
  gradient.log_scales.assign(90, 0.0f);
  AddRegularizers(regularizers, kUnit, {}, cloud, gradient);
  const auto compare = [&](Buffer<float>& values, const Buffer<float>& analytic, float before) {
    for (size_t i = 0; i < values.size(); ++i) {
      const float value = values[i];
      values[i] = value + 0.01f;
      const double up = values[i], above = loss();
      values[i] = value - 0.01f;
      const double slope = (above - loss()) / (up - values[i]);
      values[i] = value;
      EXPECT_NEAR(analytic[i] - before, slope, 1e-3 * std::abs(slope) + 2e-7) << i;
    }
  };
  compare(cloud.opacity_logits, gradient.opacity_logits, 1);
  compare(cloud.log_scales, gradient.log_scales, 0);
}

}  // namespace
}  // namespace anchorsplat
