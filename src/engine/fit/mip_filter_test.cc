#include "fit/mip_filter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "core/activations.h"
#include "core/random.h"
#include "fit/orbit_scene_for_test.h"
#include "render/rasterizer.h"

namespace anchorsplat {
namespace {

constexpr float kNoEnd = std::numeric_limits<float>::infinity();

// A camera at (0, 0, z) that looks along +z.
Camera CameraAt(double z, double focal) {
  Camera camera;
  camera.intrinsics = {100, 80, focal, 0.5 * focal, 50, 40};
  camera.world_to_camera.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  camera.world_to_camera.translation = {0, 0, -z};
  return camera;
}

TEST(MipFilter, SizesAreThePixelsOfTheClosestCamera) {
  const std::vector<Camera> cameras = {CameraAt(0, 50), CameraAt(-6, 200)};
  const Buffer<float> means = {0,   0, 2,    // 2/50 against 8/200: the same
                               0,   0, 10,   // 10/50 against 16/200
                               0,   0, -3,   // behind the first one: 3/200
                               2.2, 0, 2,    // 5 % outside of the first one's picture, which counts
                               2.8, 0, 2,    // 20 % outside, and outside of the other one's
                               0,   0, -9};  // behind both
  const double root = std::sqrt(0.2);
  const double expected[] = {2.0 / 50 * root, 16.0 / 200 * root, 3.0 / 200 * root, 2.0 / 50 * root};
  const Buffer<float> sizes = MipFilterSizes(means, cameras, 0.01f);
  ASSERT_EQ(sizes.size(), 6u);
  for (size_t i = 0; i < 4; ++i) EXPECT_NEAR(sizes[i], expected[i], 1e-7) << i;
  for (size_t i = 4; i < 6; ++i) EXPECT_EQ(sizes[i], sizes[1]) << "the largest of those that are seen";
  EXPECT_TRUE(MipFilterSizes({}, cameras, 0.01f).empty());
  EXPECT_EQ(MipFilterSizes(means, {}, 0.01f), Buffer<float>(6, 0.0f));
  const Buffer<float> nowhere = {std::nanf(""), 0, 2};
  EXPECT_EQ(MipFilterSizes(nowhere, cameras, 0.01f), Buffer<float>(1, 0.0f));
}

struct FilteredScene {
  GaussianCloud cloud = orbit_scene::Ball(20, 1);
  Buffer<float> sizes;

  FilteredScene() {
    Random random(2);
    for (float& x : cloud.opacity_logits) x = static_cast<float>(random.Uniform(-3, 5));
    for (int64_t i = 0; i < cloud.size(); ++i) sizes.push_back(static_cast<float>(random.Uniform(0.02, 0.2)));
    sizes[3] = 0;  // no filter
  }
};

// The formulas as they are written.
TEST(MipFilter, MatchesThePaper) {
  const FilteredScene s;
  MipFiltered filtered;
  const CloudView view = filtered.Of(s.cloud, s.sizes);
  EXPECT_EQ(view.means.data(), s.cloud.means.data());
  for (size_t i = 0; i < s.sizes.size(); ++i) {
    double before = 1, after = 1;
    for (size_t a = 0; a < 3; ++a) {
      const double square = std::exp(2 * double{s.cloud.log_scales[3 * i + a]});
      const double sum = square + double{s.sizes[i]} * s.sizes[i];
      before *= square;
      after *= sum;
      EXPECT_NEAR(std::exp(double{view.log_scales[3 * i + a]}), std::sqrt(sum), 1e-6) << i;
    }
    const double opacity = Sigmoid(double{s.cloud.opacity_logits[i]}) * std::sqrt(before / after);
    EXPECT_NEAR(Sigmoid(double{view.opacity_logits[i]}), opacity, 1e-6) << i;
  }
  GaussianCloud fused = s.cloud;
  FuseMipFilter(s.sizes, fused);
  EXPECT_EQ(fused.log_scales, filtered.log_scales);
  EXPECT_EQ(fused.opacity_logits, filtered.opacity_logits);
  EXPECT_EQ(fused.means, s.cloud.means);
}

TEST(MipFilter, ExtremesStayNumbers) {
  GaussianCloud cloud = orbit_scene::Ball(6, 1);
  cloud.log_scales[0] = -kNoEnd;                        // flat: invisible
  std::fill_n(cloud.log_scales.begin() + 3, 3, 30.0f);  // enormous: as it was
  std::fill_n(cloud.log_scales.begin() + 6, 3, -60.0f);
  cloud.opacity_logits[3] = kNoEnd;
  cloud.opacity_logits[4] = -kNoEnd;
  cloud.opacity_logits[5] = 80;
  const Buffer<float> sizes(6, 0.1f);
  MipFiltered filtered;
  const CloudView view = filtered.Of(cloud, sizes);
  EXPECT_EQ(view.opacity_logits[0], -kNoEnd);
  EXPECT_EQ(view.log_scales[3], 30.0f);
  EXPECT_NEAR(view.opacity_logits[1], cloud.opacity_logits[1], 1e-6);
  EXPECT_NEAR(view.log_scales[6], std::log(0.1f), 1e-6);
  EXPECT_EQ(view.opacity_logits[4], -kNoEnd);
  for (const size_t i : {1, 2, 3, 5}) EXPECT_TRUE(std::isfinite(view.opacity_logits[i])) << i;
  for (const float s : view.log_scales) EXPECT_TRUE(std::isfinite(s));
  CloudGradient gradient;
  gradient.opacity_logits.assign(6, 1.0f);
  gradient.log_scales.assign(18, 1.0f);
  MipFilterBackward(cloud, sizes, gradient);
  for (const float g : gradient.opacity_logits) EXPECT_TRUE(std::isfinite(g));
  for (const float g : gradient.log_scales) EXPECT_TRUE(std::isfinite(g));
}

// Of one linear function of what is filtered, in double.
TEST(MipFilter, GradientMatchesDifferenceQuotients) {
  FilteredScene s;
  Random random(3);
  std::vector<double> by_scale, by_logit;
  CloudGradient gradient;
  for (size_t i = 0; i < s.cloud.log_scales.size(); ++i) by_scale.push_back(random.Normal());
  for (size_t i = 0; i < s.cloud.opacity_logits.size(); ++i) by_logit.push_back(random.Normal());
  gradient.log_scales.assign(by_scale.begin(), by_scale.end());
  gradient.opacity_logits.assign(by_logit.begin(), by_logit.end());
  MipFilterBackward(s.cloud, s.sizes, gradient);
  const auto loss = [&] {
    MipFiltered filtered;
    const CloudView view = filtered.Of(s.cloud, s.sizes);
    double sum = 0;
    for (size_t i = 0; i < by_scale.size(); ++i) sum += by_scale[i] * view.log_scales[i];
    for (size_t i = 0; i < by_logit.size(); ++i) sum += by_logit[i] * view.opacity_logits[i];
    return sum;
  };
  for (const auto& [values, analytic] :
       {std::pair{&s.cloud.log_scales, &gradient.log_scales}, {&s.cloud.opacity_logits, &gradient.opacity_logits}}) {
    for (size_t i = 0; i < values->size(); ++i) {
      const float value = (*values)[i];
      (*values)[i] = value + 0.02f;
      const double up = (*values)[i], above = loss();
      (*values)[i] = value - 0.02f;
      const double slope = (above - loss()) / (up - (*values)[i]);
      (*values)[i] = value;
      EXPECT_NEAR((*analytic)[i], slope, 2e-3 * std::abs(slope) + 1e-3) << i;
    }
  }
}

// The whole chain: picture, rasterizer, filter.
TEST(MipFilter, GradientOfAPictureMatchesDifferenceQuotients) {
  FilteredScene s;
  const Camera camera = orbit_scene::Cameras(5, 24, 24).cameras[1];
  RenderOptions options = MipRendering({});
  EXPECT_EQ(options.mode, RenderMode::kMip);
  EXPECT_EQ(DilationOf(options), 0.1f);
  options.min_alpha = 1e-9f;  // no cut-offs: a difference quotient is wrong across one
  options.min_transmittance = 0;
  options.gradient = true;
  Rasterizer rasterizer;
  RenderOutput output;
  MipFiltered filtered;
  RenderGradient weights{Image(24, 24, 3), {}, {0, 0, 24, 24}};
  Random random(4);
  for (float& w : weights.color.pixels) w = static_cast<float>(random.Normal());
  const auto loss = [&] {
    EXPECT_TRUE(rasterizer.Render(filtered.Of(s.cloud, s.sizes), camera, options, output).ok());
    double sum = 0;
    for (size_t i = 0; i < output.color.pixels.size(); ++i) {
      sum += double{weights.color.pixels[i]} * output.color.pixels[i];
    }
    return sum;
  };
  (void)loss();
  CloudGradient gradient;
  ASSERT_TRUE(rasterizer.Backward(filtered.Of(s.cloud, s.sizes), weights, gradient).ok());
  MipFilterBackward(s.cloud, s.sizes, gradient);
  double largest = 0;
  for (const float g : gradient.log_scales) largest = std::max(largest, std::abs(double{g}));
  for (const auto& [values, analytic] :
       {std::pair{&s.cloud.log_scales, &gradient.log_scales}, {&s.cloud.opacity_logits, &gradient.opacity_logits}}) {
    for (size_t i = 0; i < values->size(); ++i) {
      const float value = (*values)[i];
      (*values)[i] = value + 0.004f;
      const double up = (*values)[i], above = loss();
      (*values)[i] = value - 0.004f;
      const double slope = (above - loss()) / (up - (*values)[i]);
      (*values)[i] = value;
      EXPECT_NEAR((*analytic)[i], slope, 0.01 * std::abs(slope) + 2e-3 * largest) << i;
    }
  }
}

TEST(MipFilter, OpacitiesAreCappedAsTheyShow) {
  FilteredScene s;
  const GaussianCloud before = s.cloud;
  MipFiltered filtered;
  const Buffer<float> shown_before = [&] {
    (void)filtered.Of(before, s.sizes);
    return filtered.opacity_logits;
  }();
  CapFilteredOpacities(s.sizes, 0.01, s.cloud);
  (void)filtered.Of(s.cloud, s.sizes);
  int capped = 0;
  for (size_t i = 0; i < s.sizes.size(); ++i) {
    const double shown = Sigmoid(double{filtered.opacity_logits[i]}), was = Sigmoid(double{shown_before[i]});
    EXPECT_NEAR(shown, std::min(was, 0.01), 1e-6) << i;
    capped += was > 0.01;
  }
  EXPECT_GT(capped, 10);
}

}  // namespace
}  // namespace anchorsplat
