#include "fit/view_objective.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/parallel.h"
#include "fit/orbit_scene_for_test.h"

namespace anchorsplat {
namespace {

// Whatever the splat shows is darker, so that L1 has no kink nearby.
Image White(int side) {
  Image picture(side, side, 3);
  std::fill(picture.pixels.begin(), picture.pixels.end(), 2.0f);
  Random random(5);
  for (float& x : picture.pixels) x += static_cast<float>(random.Uniform());
  return picture;
}

ObjectiveOptions Smooth(const PixelModel& pixel) {
  ObjectiveOptions options;
  options.render.min_alpha = 1e-6f;
  options.render.min_transmittance = 0;
  options.pixel = pixel;
  return options;
}

class Objective : public testing::TestWithParam<PixelModel> {};

TEST_P(Objective, GradientMatchesDifferenceQuotients) {
  GaussianCloud cloud = orbit_scene::Ball(8, 3);
  const Camera camera = orbit_scene::Cameras(3, 24, 24).cameras[1];
  const Image picture = White(24);
  const ObjectiveOptions options = Smooth(GetParam());
  ViewObjective objective;
  CloudGradient gradient;
  ASSERT_TRUE(objective.Evaluate(options, cloud, camera, picture, gradient).ok());
  EXPECT_EQ(objective.rendered().width, 24);

  const auto loss = [&] {
    CloudGradient ignored;
    return objective.Evaluate(options, cloud, camera, picture, ignored).value().loss;
  };
  const auto compare = [&](const char* name, Buffer<float>& values, const Buffer<float>& analytic, float step) {
    float largest = 0;
    for (const float g : analytic) largest = std::max(largest, std::abs(g));
    ASSERT_GT(largest, 0) << name;
    for (size_t i = 0; i < values.size(); i += 5) {
      const float value = values[i];
      values[i] = value + step;
      const double above = loss();
      values[i] = value - step;
      const double below = loss();
      values[i] = value;
      const double slope = (above - below) / (2 * step);
      EXPECT_NEAR(analytic[i], slope, 0.02 * std::abs(slope) + 0.02 * largest) << name << " " << i;
    }
  };
  compare("means", cloud.means, gradient.means, 2e-3f);
  compare("log_scales", cloud.log_scales, gradient.log_scales, 1e-2f);
  compare("quats", cloud.quats, gradient.quats, 2e-2f);
  compare("opacity_logits", cloud.opacity_logits, gradient.opacity_logits, 2e-2f);
  compare("sh", cloud.sh, gradient.sh, 2e-2f);
}

INSTANTIATE_TEST_SUITE_P(PixelModels, Objective,
                         testing::Values(PixelModel{1, 1}, PixelModel{1, 4}, PixelModel{2, 4}, PixelModel{3, 3}));

TEST(ViewObjective, SameBitsForAnyNumberOfThreads) {
  const GaussianCloud cloud = orbit_scene::Ball(200, 4);
  const Camera camera = orbit_scene::Cameras(3, 50, 50).cameras[2];
  ObjectiveOptions options;
  options.pixel = AreaModel(3);
  CloudGradient expected;
  for (const int threads : {1, 2, 5}) {
    SetThreadCount(threads);
    ViewObjective objective;
    CloudGradient gradient;
    ASSERT_TRUE(objective.Evaluate(options, cloud, camera, White(50), gradient).ok());
    if (threads == 1) expected = gradient;
    EXPECT_EQ(gradient.means, expected.means);
    EXPECT_EQ(gradient.sh, expected.sh);
  }
  SetThreadCount(0);
}

TEST(ViewObjective, RefusesRaysThatCannotBe) {
  ObjectiveOptions options;
  options.pixel = {5, 4};
  ViewObjective objective;
  CloudGradient gradient;
  const Camera camera = orbit_scene::Cameras(1, 24, 24).cameras[0];
  EXPECT_FALSE(objective.Evaluate(options, orbit_scene::Ball(3, 1), camera, White(24), gradient).ok());
}

}  // namespace
}  // namespace anchorsplat
