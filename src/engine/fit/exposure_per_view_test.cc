#include "fit/exposure_per_view.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "fit/fit.h"
#include "fit/initial_cloud.h"
#include "fit/orbit_scene_for_test.h"
#include "formats/random_cloud_for_test.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

Image Noise(uint64_t seed) {
  Image image(40, 30, 3);
  Random random(seed);
  for (float& x : image.pixels) x = static_cast<float>(random.Uniform(0.1, 0.8));
  return image;
}

Image Times(const Image& image, float gain) {
  Image out = image;
  for (float& x : out.pixels) x *= gain;
  return out;
}

TEST(ExposurePerView, FollowsWhatDiffersBetweenViews) {
  const Image scene = Noise(1);
  Buffer<float> exposures = NoExposures(2);
  Image bright, dark;
  for (int round = 0; round < 40; ++round) {
    bright = Times(scene, 1.1f);
    dark = Times(scene, 1 / 1.1f);
    ASSERT_TRUE(FollowExposure(scene, 0, bright, exposures).ok());
    ASSERT_TRUE(FollowExposure(scene, 1, dark, exposures).ok());
  }
  for (size_t i = 0; i < scene.pixels.size(); i += 7) {
    EXPECT_NEAR(bright.pixels[i], scene.pixels[i], 2e-3);
    EXPECT_NEAR(dark.pixels[i], scene.pixels[i], 2e-3);
  }
}

// A fit that is too dark everywhere must not make all of its pictures darker.
TEST(ExposurePerView, WhatAllViewsShareIsTheScenes) {
  const Image scene = Noise(2), shown = Times(scene, 0.8f);
  Buffer<float> exposures = NoExposures(2);
  Image picture;
  for (int round = 0; round < 40; ++round) {
    for (int64_t view = 0; view < 2; ++view) {
      picture = scene;
      ASSERT_TRUE(FollowExposure(shown, view, picture, exposures).ok());
    }
  }
  for (size_t i = 0; i < scene.pixels.size(); i += 7) EXPECT_NEAR(picture.pixels[i], scene.pixels[i], 1e-3);
  EXPECT_EQ(FollowExposure(shown, 2, picture, exposures).error().code, ErrorCode::kBadArgument);
}

// Views that were brightened and darkened by a tenth.
class ExposedFits : public testing::Test {
 protected:
  static constexpr int kViews = 16, kSide = 32;

  void SetUp() override {
    const CameraSet cameras = orbit_scene::Write(folder_.path(), orbit_scene::Ball(25, 1), kViews, kSide);
    clean_ = OpenProject(folder_.path(), {.hold_out = 4}).value();
    std::filesystem::create_directories(folder_ / "exposed/views");
    for (size_t i = 0; i < cameras.cameras.size(); ++i) {
      const std::string name = cameras.cameras[i].name + ".png";
      const Image picture = ReadImage(folder_ / name).value();
      (void)WritePng(folder_ / "exposed" / name, Times(picture, i % 2 == 0 ? 1.1f : 0.9f));
    }
    (void)WriteTransforms(folder_ / "exposed/transforms.json", cameras);
    exposed_ = OpenProject(folder_ / "exposed", {.hold_out = 4}).value();
    exposed_.held_out = clean_.held_out;
    options_ = FitOptionsFor(2000);
    options_.seed = 3;
    options_.densification.refine_stop_iter = 1;
    options_.densification.opacity_reset = OpacityReset::kNever;
  }
  double HeldOut(const TrainingViews& views, bool exposure) {
    options_.exposure_from = exposure ? ExposureFrom(options_.steps) : -1;
    // From the true places, so that what is left of the differences is the exposure's.
    GaussianCloud initial = InitialCloud(PointsOf(orbit_scene::Ball(25, 1)), views.scene_scale, {.seed = 3}).value();
    return Fit(views, std::move(initial), options_, {}).value().report.held_out.psnr;
  }

  TestFolder folder_;
  TrainingViews clean_, exposed_;
  FitOptions options_;
};

TEST_F(ExposedFits, BrightAndDarkViewsAreTheSameScene) {
  const double clean = HeldOut(clean_, false), without = HeldOut(exposed_, false), with = HeldOut(exposed_, true);
  EXPECT_GT(with, without + 1);
  EXPECT_GT(with, clean - 0.5);
}

TEST_F(ExposedFits, CostsNothingWhereAllViewsAreAlike) {
  EXPECT_NEAR(HeldOut(clean_, true), HeldOut(clean_, false), 0.3);
}

TEST_F(ExposedFits, GoOnFromACheckpointWithTheSameBits) {
  options_.steps = 60;
  options_.exposure_from = 10;
  const auto begin = [&](FitState state) {
    return Fitter::Begin(options_, PictureCache(exposed_.train, {0, 0, 0}), exposed_.scene_scale, std::move(state));
  };
  const GaussianCloud initial =
      InitialCloud(RandomPointsInView(60, exposed_.train, exposed_.scene_scale, 3), exposed_.scene_scale, {.seed = 3})
          .value();
  auto whole = begin(Fitter::Fresh(initial));
  ASSERT_TRUE(whole.ok()) << whole.error().message;
  while (!whole->done()) {
    ASSERT_TRUE(whole->Step().ok());
    if (whole->state().step == 30) {
      ASSERT_TRUE(WriteFitCheckpoint(folder_ / "state", whole->state(), "{}").ok());
    }
  }
  auto again = begin(ReadFitCheckpoint(folder_ / "state", "{}").value());
  ASSERT_TRUE(again.ok()) << again.error().message;
  while (!again->done()) ASSERT_TRUE(again->Step().ok());
  ExpectSameCloud(again->state().cloud, whole->state().cloud);
  EXPECT_TRUE(SameBits(again->state().exposures, whole->state().exposures));

  // A state that has no exposures, or those of other views, is another fit's.
  FitState other = ReadFitCheckpoint(folder_ / "state", "{}").value();
  other.exposures.resize(6);
  EXPECT_EQ(begin(std::move(other)).error().code, ErrorCode::kBadArgument);
}

}  // namespace
}  // namespace anchorsplat
