#include "enhance/pixel_size.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace anchorsplat {
namespace {

// Gaussians at the given points, everything else plain.
GaussianCloud CloudAt(std::initializer_list<std::array<float, 3>> points) {
  GaussianCloud cloud;
  cloud.Resize(static_cast<int64_t>(points.size()), 0);
  std::fill(cloud.log_scales.begin(), cloud.log_scales.end(), -4.0f);
  std::fill(cloud.quats.begin(), cloud.quats.end(), 0.5f);
  std::fill(cloud.opacity_logits.begin(), cloud.opacity_logits.end(), 0.0f);
  std::fill(cloud.sh.begin(), cloud.sh.end(), 0.0f);
  size_t at = 0;
  for (const auto& p : points) {
    for (const float x : p) cloud.means[at++] = x;
  }
  return cloud;
}

// Looks along +z from (0, 0, z), 100×100 pixels, focal length 50: a field of view of 90 degrees.
Camera CameraAt(double z) {
  Camera camera;
  camera.intrinsics = {100, 100, 50, 50, 50, 50};
  camera.world_to_camera.translation = {0, 0, -z};
  return camera;
}

TEST(PixelSizesFromCameras, SmallestOverTheViewsThatSeeIt) {
  const GaussianCloud cloud = CloudAt({{0, 0, 4}, {9, 0, 4}, {0, 0, -20}, {0, 0, 1}});
  CameraSet cameras;
  cameras.cameras = {CameraAt(0), CameraAt(-6)};
  const auto sizes = PixelSizesFromCameras(cloud, cameras);
  ASSERT_TRUE(sizes.ok());
  EXPECT_FLOAT_EQ(sizes->sizes[0], 4.0f / 50);   // both see it, the near one counts
  EXPECT_FLOAT_EQ(sizes->sizes[1], 10.0f / 50);  // outside the near one's image
  EXPECT_FLOAT_EQ(sizes->sizes[2], 14.0f / 50);  // behind both: plain distance to the nearest
  EXPECT_FLOAT_EQ(sizes->sizes[3], 1.0f / 50);
  EXPECT_EQ(sizes->unseen, 1);
  EXPECT_FLOAT_EQ(sizes->median, 0.5f * (4.0f + 10.0f) / 50);
}

TEST(PixelSizesFromCameras, MedianOverTheViewsThatSeeIt) {
  const GaussianCloud cloud = CloudAt({{0, 0, 4}, {9, 0, 4}, {0, 0, -20}});
  CameraSet cameras;
  cameras.cameras = {CameraAt(0), CameraAt(-6), CameraAt(-10)};
  const auto sizes = PixelSizesFromCameras(cloud, cameras, CameraPixelRule::kMedian);
  ASSERT_TRUE(sizes.ok());
  EXPECT_FLOAT_EQ(sizes->sizes[0], 10.0f / 50);  // of 4, 10 and 14
  EXPECT_FLOAT_EQ(sizes->sizes[1], 12.0f / 50);  // of 10 and 14
  EXPECT_FLOAT_EQ(sizes->sizes[2], 10.0f / 50);  // behind all: the nearest camera's distance
}

TEST(PixelSizesFromCameras, FollowTheUnitOfTheScene) {
  for (const float unit : {1e-4f, 1.0f, 1e5f}) {
    const GaussianCloud cloud = CloudAt({{0, 0, 4 * unit}, {unit, 0, 5 * unit}, {0, unit, 6 * unit}});
    CameraSet cameras;
    cameras.cameras = {CameraAt(0)};
    const auto sizes = PixelSizesFromCameras(cloud, cameras);
    ASSERT_TRUE(sizes.ok());
    EXPECT_EQ(sizes->unseen, 0) << unit;
    EXPECT_FLOAT_EQ(sizes->sizes[0], unit * 4 / 50);
  }
}

TEST(PixelSizesFromCameras, TrainWidthOnlyShrinks) {
  const GaussianCloud cloud = CloudAt({{0, 0, 5}});
  CameraSet cameras;
  cameras.cameras = {CameraAt(0)};
  EXPECT_FLOAT_EQ(PixelSizesFromCameras(cloud, AtTrainWidth(cameras, 25))->sizes[0], 0.4f);
  EXPECT_FLOAT_EQ(PixelSizesFromCameras(cloud, AtTrainWidth(cameras, 100))->sizes[0], 0.1f);
  EXPECT_FLOAT_EQ(PixelSizesFromCameras(cloud, AtTrainWidth(cameras, 1600))->sizes[0], 0.1f);
  EXPECT_FALSE(PixelSizesFromCameras(cloud, CameraSet{}).ok());
}

TEST(PixelSizesFromCameras, BrokenMeansGetTheMedian) {
  const float nan = std::nanf("");
  const GaussianCloud cloud =
      CloudAt({{nan, 0, 5}, {0, 0, 5}, {0, 0, 5}, {0, std::numeric_limits<float>::infinity(), 0}});
  CameraSet cameras;
  cameras.cameras = {CameraAt(0)};
  const auto sizes = PixelSizesFromCameras(cloud, cameras);
  ASSERT_TRUE(sizes.ok());
  for (const float size : sizes->sizes) EXPECT_FLOAT_EQ(size, 0.1f);
}

TEST(AssumedTrainWidth, OnlyWhereTheConventionKeepsTheOriginalSize) {
  CameraSet cameras;
  cameras.cameras = {CameraAt(0)};
  cameras.source = CameraSource::kInria;
  EXPECT_FALSE(AssumedTrainWidth(cameras).has_value());
  cameras.cameras[0].intrinsics.width = 4000;
  EXPECT_EQ(AssumedTrainWidth(cameras), 1600);
  cameras.source = CameraSource::kColmap;
  EXPECT_EQ(AssumedTrainWidth(cameras), 1600);
  cameras.source = CameraSource::kTransforms;
  EXPECT_FALSE(AssumedTrainWidth(cameras).has_value());
}

}  // namespace
}  // namespace anchorsplat
