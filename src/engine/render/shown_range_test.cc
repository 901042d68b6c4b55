#include "render/shown_range.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "render/scenes_for_test.h"

namespace anchorsplat {
namespace {

using namespace test;
using testing::HasSubstr;

double Psnr(const Image& a, const Image& b) {
  double sum = 0;
  for (size_t i = 0; i < a.pixels.size(); ++i) {
    const double d = double{a.pixels[i]} - double{b.pixels[i]};
    sum += d * d;
  }
  return -10 * std::log10(sum / static_cast<double>(a.pixels.size()));
}

GaussianCloud InUnit(GaussianCloud cloud, double unit) {
  for (float& x : cloud.means) x = static_cast<float>(x * unit);
  for (float& x : cloud.log_scales) x = static_cast<float>(x + std::log(unit));
  return cloud;
}

Camera InUnit(Camera camera, double unit) {
  for (double& x : camera.world_to_camera.translation) x *= unit;
  return camera;
}

RenderOutput Shown(const GaussianCloud& cloud, const Camera& camera) {
  Rasterizer rasterizer;
  RenderOutput output;
  const Status status = rasterizer.Render(cloud, camera, DisplayOptions(cloud), output);
  EXPECT_TRUE(status.ok()) << status.error().message;
  EXPECT_EQ(EmptyPictureReason(cloud, camera, DisplayOptions(cloud), rasterizer.statistics().visible), "");
  return output;
}

TEST(ShownRange, PicturesDoNotDependOnTheUnit) {
  const GaussianCloud cloud = RandomCloud(7, {.gaussians = 300});
  const Camera camera = RandomCamera(7, 80, 60);
  const RenderOutput expected = Shown(cloud, camera);
  for (const double unit : {1e-9, 1e-4, 0.003, 0.007, 1000.0, 1e5, 1e12}) {
    EXPECT_GT(Psnr(Shown(InUnit(cloud, unit), InUnit(camera, unit)).color, expected.color), 60) << unit;
  }
}

TEST(ShownRange, LargeScenesAreCutWhereFitsCutThem) {
  GaussianCloud cloud = RandomCloud(8, {.gaussians = 300});
  for (float& x : cloud.means) x *= 20;
  const Camera camera = InUnit(RandomCamera(8, 80, 60), 20);
  EXPECT_EQ(NearPlane(DisplayOptions(cloud), camera), kNear);
  RenderOutput plain;
  ASSERT_TRUE(Rasterizer().Render(cloud, camera, {}, plain).ok());
  EXPECT_EQ(Shown(cloud, camera).color.pixels, plain.color.pixels);
}

TEST(ShownRange, NearPlaneIsAThousandthOfTheDistance) {
  RenderOptions options;
  Camera camera = FrontCamera(10, 10, 10);
  EXPECT_EQ(NearPlane(options, camera), kNear);
  options.subject = Framing{{0, 0, 2}, 0.5};
  EXPECT_FLOAT_EQ(NearPlane(options, camera), 0.002f);
  options.subject = Framing{{0, 0, 0.1}, 0.5};  // from within: its radius
  EXPECT_FLOAT_EQ(NearPlane(options, camera), 0.0005f);
  options.subject = Framing{{0, 0, 500}, 0.5};
  EXPECT_EQ(NearPlane(options, camera), kNear);
  options.near_plane = 3;
  EXPECT_FLOAT_EQ(NearPlane(options, camera), 0.5f);
  options.subject = Framing{{std::nan(""), 0, 0}, 0.5};
  EXPECT_GT(NearPlane(options, camera), 0);
}

TEST(ShownRange, FitsKeepTheirPlanes) {
  const RenderOptions of_a_fit;
  EXPECT_FALSE(of_a_fit.subject);
  EXPECT_EQ(of_a_fit.near_plane, 0.01f);
  EXPECT_EQ(of_a_fit.far_plane, 1e10f);
}

TEST(ShownRange, SaysWhyThereIsNothingToSee) {
  GaussianCloud cloud;
  for (int i = 0; i < 2000; ++i) ASSERT_TRUE(Append(cloud, OneGaussian(0, 0, 0.005, 0.001, 0.5)).ok());
  Camera camera = FrontCamera(16, 16, 16);
  camera.name = "lr/\x1b[2J";
  RenderOptions options;
  std::string text = EmptyPictureReason(cloud, camera, options, 0);
  EXPECT_THAT(text, HasSubstr("view lr/\\x1b[2J shows nothing of the 2,000 Gaussians: 2,000 before the near plane"));
  options.near_plane = 1e-4f;
  EXPECT_EQ(EmptyPictureReason(cloud, camera, options, 2000), "");
  EXPECT_EQ(EmptyPictureReason(cloud, camera, options, std::nullopt), "");
  EXPECT_THAT(EmptyPictureReason(cloud, camera, options, 0), HasSubstr("2,000 in range but beside the picture"));
  GaussianCloud faint = cloud;
  for (float& logit : faint.opacity_logits) logit = -std::numeric_limits<float>::infinity();
  EXPECT_THAT(EmptyPictureReason(faint, camera, options, 0), HasSubstr("Gaussians: 2,000 less opaque than 1/255;"));
  for (size_t i = 0; i < 1000; ++i) faint.means[3 * i + 2] = -1;  // the faint ones are not those beside the picture
  for (size_t i = 1000; i < 2000; ++i) faint.opacity_logits[i] = 0;
  EXPECT_THAT(EmptyPictureReason(faint, camera, options, 0),
              HasSubstr("1,000 behind the camera, 1,000 in range but beside the picture"));
  options.far_plane = 2e-4f;
  EXPECT_THAT(EmptyPictureReason(cloud, camera, options, std::nullopt),
              HasSubstr("2,000 beyond the far plane (0.0002)"));
  options.far_plane = kNoFar;
  for (size_t i = 1; i < 2000; ++i) cloud.means[3 * i + 2] = -1;
  text = EmptyPictureReason(cloud, camera, options, 1);
  EXPECT_THAT(text, HasSubstr("almost nothing"));
  EXPECT_THAT(text, HasSubstr("1,999 behind the camera, 1 in range"));
  cloud.means[5] = 0.005f;  // two of two thousand are some
  EXPECT_EQ(EmptyPictureReason(cloud, camera, options, 1), "");
}

TEST(ShownRange, RefusesPlanesTheWrongWayRound) {
  RenderOutput output;
  RenderOptions options;
  options.far_plane = options.near_plane;
  EXPECT_FALSE(Rasterizer().Render(OneGaussian(0, 0, 2, 0.1, 0.5), FrontCamera(8, 8, 8), options, output).ok());
}

TEST(ShownRange, InfiniteOpacityIsOpaqueAndFlatIsSeen) {
  GaussianCloud cloud = OneGaussian(0, 0, 2, 0.2, 0.5);
  cloud.opacity_logits[0] = std::numeric_limits<float>::infinity();
  const Camera camera = FrontCamera(16, 16, 40);
  EXPECT_NEAR(Shown(cloud, camera).alpha.at(0, 8, 8), 0.99, 0.01);
  cloud.log_scales[2] = -std::numeric_limits<float>::infinity();  // along the view
  EXPECT_NEAR(Shown(cloud, camera).alpha.at(0, 8, 8), 0.99, 0.01);
}

}  // namespace
}  // namespace anchorsplat
