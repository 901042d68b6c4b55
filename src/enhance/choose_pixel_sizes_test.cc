#include "enhance/choose_pixel_sizes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "cameras/camera_io.h"
#include "core/random.h"
#include "core/rotation.h"
#include "core/source_dir_for_test.h"
#include "enhance/enhance.h"
#include "enhance/enhanced_look.h"
#include "enhance/pixel_size_guard.h"
#include "formats/cloud_io.h"

namespace anchorsplat {
namespace {

constexpr double kBedPixel = 0.01467;  // of the pictures, 96² from a distance of 1.7 at 45°

// As its training left it: SPZ keeps unit quaternions.
GaussianCloud BedOfSoftPictures() {
  auto cloud = ReadCloud(SourceDirForTest() / "testdata/splats/bed.soft-antialiased.spz");
  EXPECT_TRUE(cloud.ok());
  Random random(3);
  for (size_t i = 0; i < static_cast<size_t>(cloud->size()); ++i) {
    const auto length = static_cast<float>(random.Uniform(0.5, 1.5));
    for (size_t k = 0; k < 4; ++k) cloud->quats[4 * i + k] *= length;
  }
  return *std::move(cloud);
}

CameraSet TrainingCameras() {
  CameraSet set;
  const double focal = 48 / std::tan(std::numbers::pi / 8);
  for (int i = 0; i < 12; ++i) {
    const double angle = 2 * std::numbers::pi * i / 12;
    Camera& camera = set.cameras.emplace_back();
    camera.intrinsics = {96, 96, focal, focal, 48, 48};
    camera.world_to_camera =
        *LookAt({1.6 * std::cos(angle), 0.57, 1.6 * std::sin(angle)}, {0.0, 0.0, 0.0}, {0.0, 1.0, 0.0});
  }
  return set;
}

TEST(ChoosePixelSizes, AntialiasedFitsToSoftPicturesAreTakenForLessThanTheirCamerasSay) {
  const GaussianCloud bed = BedOfSoftPictures();
  ASSERT_EQ(bed.render_mode, RenderMode::kAntialiased);
  ASSERT_TRUE(HasQuaternionsOfTraining(bed));
  const auto found = FindPixelSize(bed);
  ASSERT_TRUE(found.ok());
  EXPECT_FALSE(found->contradicted());
  EXPECT_LT(found->size, 0.6 * kBedPixel);
  EnhanceOptions options;
  options.method = "filter";
  options.cameras = TrainingCameras();
  const auto softer = Enhance(GaussianCloud(bed), options);
  ASSERT_TRUE(softer.ok()) << softer.error().message;
  EXPECT_NEAR(softer->report.pixel_size, found->size, 1e-3 * found->size);
  EXPECT_EQ(softer->report.pixel_size_source, "estimated");
  // Whoever says that it is antialiased means these cameras.
  options.given = {"mode"};
  const auto said = Enhance(GaussianCloud(bed), options);
  ASSERT_TRUE(said.ok());
  EXPECT_EQ(said->report.pixel_size_source, "cameras");
  EXPECT_NEAR(said->report.pixel_size, kBedPixel, 0.1 * kBedPixel);
  // Cameras of smaller pixels are believed.
  options.given.clear();
  for (Camera& camera : options.cameras->cameras)
    camera.intrinsics = {192, 192, 2 * camera.intrinsics.fx, 2 * camera.intrinsics.fy, 96, 96};
  const auto fine = Enhance(GaussianCloud(bed), options);
  ASSERT_TRUE(fine.ok());
  EXPECT_NEAR(fine->report.pixel_size, kBedPixel / 2, 0.05 * kBedPixel);
}

// Who does not say how it was trained may have an antialiased splat that looks classic. The estimate of this one is
// rough, and says nothing against cameras else.
TEST(ChoosePixelSizes, UntaggedSplatsOfFarFinerLooksAreNotWidenedByTheirCameras) {
  const GaussianCloud table = ReadCloud(SourceDirForTest() / "testdata/splats/table.mcmc.spz").value();
  const auto found = FindPixelSize(table);
  ASSERT_TRUE(found.ok());
  ASSERT_TRUE(found->rough());
  const double own = found->estimate.size;
  EnhanceOptions options;
  options.method = "filter";
  const auto pixel_with = [&](double of_cameras, std::optional<RenderMode> tag) {
    options.cameras = TrainingCameras();
    for (Camera& camera : options.cameras->cameras) camera.intrinsics.fx = camera.intrinsics.fy = 1.7 / of_cameras;
    GaussianCloud cloud = table;
    cloud.render_mode = tag;
    const auto enhanced = Enhance(std::move(cloud), options);
    EXPECT_TRUE(enhanced.ok());
    return enhanced->report.pixel_size;
  };
  EXPECT_NEAR(pixel_with(2 * own, {}), 2 * own, 0.2 * own);
  EXPECT_NEAR(pixel_with(2.9 * own, RenderMode::kClassic), 2.9 * own, 0.3 * own);
  EXPECT_LT(pixel_with(2.9 * own, {}), 1.5 * own);
}

// MCMC of a black object over black ends so.
TEST(ChoosePixelSizes, WhatShowsNothingStaysAsItIs) {
  GaussianCloud cloud = BedOfSoftPictures();
  for (float& logit : cloud.opacity_logits) logit = -15;
  EnhanceOptions options;
  options.method = "filter";
  for (const bool cameras : {false, true}) {
    if (cameras) options.cameras = TrainingCameras();
    const auto same = Enhance(GaussianCloud(cloud), options);
    ASSERT_TRUE(same.ok()) << same.error().message;
    EXPECT_EQ(same->report.pixel_size_source, kUnknownPixelSize);
    EXPECT_TRUE(std::ranges::equal(same->cloud.log_scales, cloud.log_scales));
  }
}

// Leaves and twigs are taken for a seventh of their pixels, and lie seven of such apart: that says nothing against
// cameras of pixels that they lie one of apart.
TEST(ChoosePixelSizes, CamerasOfGaussiansThatLieFarApartAreBelieved) {
  PixelSizeEvidence evidence;
  evidence.gaussians = evidence.all = 20'000;
  evidence.spacing = evidence.footprint = evidence.of_many = evidence.dense = evidence.closest = 0.007;
  evidence.small_axis = 0.001;
  const PixelSizeEstimate leaves{.size = 0.001, .low = 0.0008, .high = 0.0012};
  const PixelSizeFinding found = Judge(leaves, evidence);
  EXPECT_TRUE(LiesAsFitsTo(0.007, found));
  EXPECT_FALSE(IsSharperThanFitsTo(0.007, found));
  EXPECT_FALSE(LiesTooCloseFor(0.007, found));
  // Not of pixels that they lie a third of apart.
  EXPECT_FALSE(LiesAsFitsTo(0.021, found));
  EXPECT_TRUE(IsSharperThanFitsTo(0.021, found));
  EXPECT_TRUE(LiesTooCloseFor(0.021, found));
  evidence.dense = 0.004;
  EXPECT_FALSE(LiesAsFitsTo(0.007, Judge(leaves, evidence))) << "as far apart as in other fits";
}

// The regression of antialiased splats has seen objects alone.
TEST(ChoosePixelSizes, RoomsAroundAntialiasedObjectsContradict) {
  PixelSizeEvidence evidence;
  evidence.gaussians = evidence.all = 7000;
  evidence.spacing = evidence.footprint = evidence.of_many = evidence.dense = evidence.closest = 0.12;
  evidence.small_axis = 0.05;
  PixelSizeEstimate rabbit{.size = 0.1, .low = 0.06, .high = 0.17, .strangeness = 1.1};
  rabbit.of_antialiased = true;
  rabbit.coarse_outlines = 0.12;
  EXPECT_TRUE(Judge(rabbit, evidence).contradicted());
  PixelSizeEstimate alone = rabbit;
  alone.coarse_outlines = 0.02;
  EXPECT_FALSE(Judge(alone, evidence).contradicted());
  PixelSizeEstimate familiar = rabbit;
  familiar.strangeness = 0.9;
  EXPECT_FALSE(Judge(familiar, evidence).contradicted());
  PixelSizeEstimate classic = rabbit;
  classic.of_antialiased = false;
  EXPECT_FALSE(Judge(classic, evidence).contradicted());
}

}  // namespace
}  // namespace anchorsplat
