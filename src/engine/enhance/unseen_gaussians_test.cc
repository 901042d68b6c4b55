#include "enhance/unseen_gaussians.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "core/random.h"
#include "core/spherical_harmonics.h"
#include "enhance/enhance.h"
#include "fit/orbit_scene_for_test.h"
#include "metrics/image_metrics.h"
#include "render/rasterizer.h"

namespace anchorsplat {
namespace {

constexpr int64_t kObject = 400, kDust = 300;

void Paint(GaussianCloud& cloud, float level) { std::ranges::fill(cloud.sh, DcFromColor(level)); }

// A bright ball, and around it dust of the brightness `level`.
GaussianCloud Dusty(float level) {
  GaussianCloud cloud = orbit_scene::Ball(kObject, 5), dust = orbit_scene::Ball(kDust, 6);
  for (float& c : cloud.sh) c = std::abs(c) + 0.5f;
  Paint(dust, level);
  for (float& x : dust.means) x *= 1.8f;
  EXPECT_TRUE(Append(cloud, dust).ok());
  return cloud;
}

std::vector<Camera> Views() { return orbit_scene::Cameras(12, 64, 64).cameras; }

struct Agreement {
  double worst = 0, together = 0;  // dB: of the worst view, of all together
};

Agreement AgreementWithout(const GaussianCloud& cloud, const std::vector<int64_t>& rows,
                           const std::array<float, 3>& background) {
  GaussianCloud without = cloud;
  for (const int64_t i : rows) without.opacity_logits[static_cast<size_t>(i)] = -100;
  Rasterizer rasterizer;
  RenderOutput a, b;
  RenderOptions options;
  options.background = background;
  double worst = 0, all = 0;
  for (const Camera& camera : Views()) {
    EXPECT_TRUE(rasterizer.Render(cloud, camera, options, a).ok());
    EXPECT_TRUE(rasterizer.Render(without, camera, options, b).ok());
    Clamp01(a.color);
    Clamp01(b.color);
    double squares = 0;
    for (size_t k = 0; k < a.color.pixels.size(); ++k) {
      squares += std::pow(double{a.color.pixels[k]} - double{b.color.pixels[k]}, 2);
    }
    worst = std::max(worst, squares);
    all += squares;
  }
  return {-10 * std::log10(worst / (64 * 64 * 3)), -10 * std::log10(all / (12.0 * 64 * 64 * 3))};
}

double PsnrWithout(const GaussianCloud& cloud, const std::vector<int64_t>& rows,
                   const std::array<float, 3>& background) {
  return AgreementWithout(cloud, rows, background).worst;
}

TEST(Unseen, DustOfTheBackgroundsColourGoes) {
  for (const float level : {0.0f, 1.0f}) {
    const GaussianCloud cloud = Dusty(level);
    const auto found = FindUnseen(cloud, Views(), {.background = {level, level, level}});
    ASSERT_TRUE(found.ok()) << found.error().message;
    EXPECT_EQ(found->views, 12);
    EXPECT_GT(std::ssize(found->rows), kDust / 10);
    for (const int64_t i : found->rows) EXPECT_TRUE(level == 1 || i >= kObject) << "a part of the bright object";
    const double psnr = PsnrWithout(cloud, found->rows, {level, level, level});
    EXPECT_GE(psnr, 50);
    EXPECT_NEAR(psnr, found->psnr, 0.05);
    // One more of them would be missed, or there is none.
    EXPECT_TRUE(psnr < 53 || std::ssize(found->rows) == kDust) << psnr;
  }
}

// Against taking each of them out alone.
TEST(Unseen, WhatAddsLeastGoesFirst) {
  const GaussianCloud cloud = Dusty(0);
  const auto found = FindUnseen(cloud, Views(), {});
  ASSERT_TRUE(found.ok());
  double gone = 0, kept = 0;
  int64_t of_gone = 0, of_kept = 0;
  for (int64_t i = kObject; i < kObject + kDust; i += 2) {
    const double squares = std::pow(10, -PsnrWithout(cloud, {i}, {}) / 10);
    const bool is_gone = std::ranges::binary_search(found->rows, i);
    (is_gone ? gone : kept) += squares;
    ++(is_gone ? of_gone : of_kept);
  }
  ASSERT_GT(of_gone, 3);
  ASSERT_GT(of_kept, 3);
  EXPECT_LT(gone / static_cast<double>(of_gone), 0.05 * kept / static_cast<double>(of_kept));
}

// What is seen over the background, or hides what is bright, stays.
TEST(Unseen, WhatShowsStays) {
  const auto other = FindUnseen(Dusty(0), Views(), {.background = {1, 1, 1}});
  ASSERT_TRUE(other.ok());
  for (const int64_t i : other->rows) EXPECT_LT(i, kObject) << "black on white";
  GaussianCloud cover = orbit_scene::Ball(200, 5);
  Paint(cover, 1);
  GaussianCloud shell = orbit_scene::Ball(200, 5);
  Paint(shell, 0);
  for (size_t i = 0; i < shell.means.size(); ++i) {
    shell.means[i] *= 1.3f;
    shell.opacity_logits[i / 3] = 6;
  }
  ASSERT_TRUE(Append(cover, shell).ok());
  const auto found = FindUnseen(cover, Views(), {});
  ASSERT_TRUE(found.ok());
  EXPECT_GE(PsnrWithout(cover, found->rows, {}), 50);
  EXPECT_LT(std::ssize(found->rows), 100) << "most of the shell hides something";
}

TEST(Unseen, WithoutCamerasItLooksFromAllAround) {
  const auto found = FindUnseen(Dusty(0), {}, {});
  ASSERT_TRUE(found.ok());
  EXPECT_EQ(found->views, 24);
  EXPECT_GT(std::ssize(found->rows), kDust / 10);
}

// In any unit, for any number of threads, in any mode and with harmonics.
TEST(Unseen, TheSameInAnyUnit) {
  for (const RenderMode mode : {RenderMode::kClassic, RenderMode::kAntialiased}) {
    GaussianCloud cloud = Dusty(0);
    cloud.render_mode = mode;
    const auto found = FindUnseen(cloud, Views(), {});
    ASSERT_TRUE(found.ok());
    ASSERT_GT(std::ssize(found->rows), 10);
    for (const double scale : {1e-4, 1e4}) {
      GaussianCloud other = cloud;
      std::vector<Camera> views = Views();
      for (float& x : other.means) x *= static_cast<float>(scale);
      for (float& s : other.log_scales) s += static_cast<float>(std::log(scale));
      for (Camera& view : views) {
        for (double& x : view.world_to_camera.translation) x *= scale;
      }
      const auto again = FindUnseen(other, views, {});
      ASSERT_TRUE(again.ok());
      EXPECT_NEAR(std::ssize(again->rows), std::ssize(found->rows), 0.1 * kDust) << scale;
      if (mode == RenderMode::kClassic || scale > 1) continue;  // views all around take long
      const auto around = FindUnseen(other, {}, {});
      ASSERT_TRUE(around.ok());
      EXPECT_LT(std::ssize(around->rows), kDust) << "not all of it";
    }
  }
}

TEST(Unseen, WhatNoViewDrawsStays) {
  const std::vector<Camera> views = {Views().front()};
  GaussianCloud cloud = Dusty(0), behind = orbit_scene::Ball(50, 7);
  Paint(behind, 0);
  for (size_t i = 0; i < behind.means.size(); ++i) {
    behind.means[i] += 5 * static_cast<float>(views.front().Center()[i % 3]);
  }
  ASSERT_TRUE(Append(cloud, behind).ok());
  const auto found = FindUnseen(cloud, views, {});
  ASSERT_TRUE(found.ok());
  ASSERT_GT(std::ssize(found->rows), 10);
  for (const int64_t i : found->rows) EXPECT_LT(i, kObject + kDust);
  const auto nothing = FindUnseen(behind, views, {});
  ASSERT_FALSE(nothing.ok());
  EXPECT_NE(nothing.error().message.find("shows any of the splat"), std::string::npos);
}

TEST(Unseen, PredictsDustWithoutTrying) {
  GaussianCloud cloud = Dusty(0);
  for (size_t k = 0; k < 3 * kObject; ++k) cloud.means[k] *= 0.6f;  // less that is bright behind the dust
  const auto found = PredictUnseen(cloud);
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_GT(std::ssize(*found), kDust / 20);
  for (const int64_t i : *found) EXPECT_GE(i, kObject);
  EXPECT_GE(AgreementWithout(cloud, *found, {}).together, 42);  // they add up, which the sum of squares does not know
  // The same dust inside of an opaque bright shell reaches no view: who knows what is seen from within.
  GaussianCloud within = orbit_scene::Ball(kDust, 6), shell = orbit_scene::Ball(2000, 5);
  Paint(within, 0);
  Paint(shell, 1);
  for (size_t i = 0; i < 2000; ++i) {
    const double norm = std::hypot(shell.means[3 * i], shell.means[3 * i + 1], shell.means[3 * i + 2]);
    for (size_t c = 0; c < 3; ++c) {
      shell.means[3 * i + c] *= static_cast<float>(3 / norm);
      shell.log_scales[3 * i + c] = std::log(0.5f);
    }
    shell.opacity_logits[i] = 6;
  }
  ASSERT_TRUE(Append(within, shell).ok());
  const auto hidden = PredictUnseen(within);
  ASSERT_TRUE(hidden.ok());
  EXPECT_TRUE(hidden->empty()) << hidden->size();
  GaussianCloud bright = Dusty(1);
  EXPECT_TRUE(PredictUnseen(bright)->empty());
  EXPECT_TRUE(PredictUnseen({})->empty());
}

TEST(Unseen, EdgeCases) {
  EXPECT_FALSE(FindUnseen(Dusty(0), Views(), {.least_psnr = 0}).ok());
  GaussianCloud cloud = Dusty(0);
  cloud.means[0] = std::nanf("");
  cloud.log_scales[3 * kObject] = std::numeric_limits<float>::infinity();
  cloud.opacity_logits[kObject + 1] = std::numeric_limits<float>::infinity();
  cloud.opacity_logits[kObject + 2] = -std::numeric_limits<float>::infinity();
  const auto found = FindUnseen(cloud, Views(), {});
  ASSERT_TRUE(found.ok());
  ASSERT_GT(std::ssize(found->rows), 10);
  for (const int64_t i : found->rows) {
    EXPECT_GT(i, kObject) << "usable ones only";
  }
  const auto one = Subset(cloud, std::vector<int64_t>{kObject + 5});
  const auto alone = FindUnseen(*one, Views(), {});
  ASSERT_TRUE(alone.ok());
  EXPECT_EQ(alone->rows, std::vector<int64_t>{0});
  EXPECT_EQ(alone->psnr, std::numeric_limits<double>::infinity());
}

TEST(Unseen, EnhanceCleans) {
  EnhanceOptions options;
  options.method = "filter";
  options.mode = RenderMode::kClassic;
  options.pixel_size = 0.01;
  options.clean = true;
  const auto cleaned = Enhance(Dusty(0), options);
  ASSERT_TRUE(cleaned.ok());
  ASSERT_TRUE(cleaned->report.cleaned);
  const int64_t gone = std::ssize(cleaned->report.cleaned->rows);
  EXPECT_GT(gone, 0);
  EXPECT_EQ(cleaned->cloud.size(), kObject + kDust - gone);
  options.background = {{1, 1, 1}};
  const auto kept = Enhance(Dusty(0), options);
  ASSERT_TRUE(kept.ok());
  for (const int64_t i : kept->report.cleaned->rows) EXPECT_LT(i, kObject) << "black is seen on white";
  options.background = {{0, 0, std::nanf("")}};
  EXPECT_FALSE(Enhance(Dusty(0), options).ok());
  options.background = {{0, 0, 0}};
  options.clean = false;
  EXPECT_FALSE(Enhance(Dusty(0), options).ok()) << "a background without cleaning";
  options.clean = true;
  GaussianCloud black = orbit_scene::Ball(50, 5);
  Paint(black, 0);
  options.background.reset();
  const auto nothing = Enhance(black, options);
  ASSERT_FALSE(nothing.ok());
  EXPECT_NE(nothing.error().message.find("--background"), std::string::npos);
}

}  // namespace
}  // namespace anchorsplat
