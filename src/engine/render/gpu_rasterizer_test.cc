#include "render/gpu_rasterizer.h"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <memory>

#include "render/gpu_scene_for_test.h"
#include "render/scenes_for_test.h"

namespace anchorsplat {
namespace {

using test::DrawOnCpu;
using test::DrawOnGpu;
using test::FrontCamera;
using test::OneGaussian;
using test::RandomCamera;
using test::RandomCloud;
using test::SameBits;
using test::Tally;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

class GpuRasterizerTest : public testing::Test {
 protected:
  void SetUp() override {
    std::shared_ptr<GpuDevice> device = GpuForTest();
    if (device == nullptr) GTEST_FAIL() << "no device";
    gpu_ = std::make_unique<GpuRasterizer>(std::move(device));
  }
  void Compare(const CloudView& cloud, const Camera& camera, const RenderOptions& options) {
    RenderStatistics statistics;
    const RenderOutput expected = DrawOnCpu(cloud, camera, options, &statistics);
    tally_.Add(expected, DrawOnGpu(*gpu_, cloud, camera, options));
    // A rectangle whose edge lies right on a tile's may have a tile more or less.
    EXPECT_NEAR(static_cast<double>(gpu_->visible), static_cast<double>(statistics.visible), 1);
    EXPECT_NEAR(static_cast<double>(gpu_->total_pairs), static_cast<double>(statistics.pairs),
                2 + 1e-3 * static_cast<double>(statistics.pairs));
  }
  void TearDown() override {
    if (tally_.values > 0) tally_.ExpectEqual();
  }

  std::unique_ptr<GpuRasterizer> gpu_;
  Tally tally_;
};

TEST_F(GpuRasterizerTest, EqualsTheCpuInAllModesAndProfiles) {
  const std::array<std::array<int, 2>, 5> sizes = {{{67, 41}, {16, 16}, {1, 1}, {131, 93}, {33, 70}}};
  for (uint64_t seed = 0; seed < 30; ++seed) {
    const auto& size = sizes[seed % sizes.size()];
    RenderOptions options;
    options.profile = seed % 2 == 0 ? RasterProfile::kGsplat14 : RasterProfile::kGsplat15;
    options.mode = kRenderModes[seed / 2 % 3];
    options.depth = seed % 3 != 0;
    options.background = {0.1f, 0.7f, 0.3f};
    Compare(RandomCloud(seed, {.gaussians = 400}), RandomCamera(seed, size[0], size[1]), options);
  }
}

TEST_F(GpuRasterizerTest, EqualsTheCpuWithOtherOptions) {
  const GaussianCloud cloud = RandomCloud(7, {.gaussians = 500});
  const Camera camera = RandomCamera(7, 64, 64);
  RenderOptions options;
  options.depth = true;
  for (const int degree : {0, 1, 2}) {
    options.sh_degree = degree;
    Compare(cloud, camera, options);
  }
  options = {.dilation = 0.0f};
  Compare(cloud, camera, options);
  options = {.mode = RenderMode::kAntialiased, .dilation = 1.5f, .compensated_from = 0.4f};
  Compare(cloud, camera, options);
  options = {};
  options.min_alpha = 1e-6f;
  options.min_transmittance = 0;
  Compare(cloud, camera, options);
  options = {};
  options.min_alpha = 0.2f;
  options.min_transmittance = 0.3f;
  Compare(cloud, camera, options);
  options = {};
  options.near_plane = 2.9f;
  options.far_plane = 3.2f;
  Compare(cloud, camera, options);
  options.subject = Framing{.target = {0, 0, 0}, .radius = 0.001};
  Compare(cloud, camera, options);
}

TEST_F(GpuRasterizerTest, OtherDegrees) {
  for (const int degree : {0, 1, 2}) {
    Compare(RandomCloud(11, {.gaussians = 200, .degree = degree}), RandomCamera(11, 40, 30), {});
  }
}

TEST_F(GpuRasterizerTest, NoneAndOne) {
  GaussianCloud none;
  none.Resize(0, 3);
  const Camera camera = FrontCamera(37, 21, 30);
  RenderOptions options;
  options.background = {0.25f, 0.5f, 0.75f};
  options.depth = true;
  EXPECT_TRUE(SameBits(DrawOnCpu(none, camera, options), DrawOnGpu(*gpu_, none, camera, options)));
  Compare(OneGaussian(0.1, -0.05, 2, 0.2, 0.9), camera, options);
  EXPECT_EQ(gpu_->visible, 1);
  Compare(OneGaussian(0.1, -0.05, -2, 0.2, 0.9), camera, options);
  EXPECT_EQ(gpu_->visible, 0);
}

// Every value that makes a Gaussian unusable, and those that look like it but do not.
TEST_F(GpuRasterizerTest, ValuesThatAreNotFinite) {
  GaussianCloud cloud = RandomCloud(13, {.gaussians = 300});
  const std::array<float, 5> values = {kNan, kInfinity, -kInfinity, std::numeric_limits<float>::max(), 1e-42f};
  size_t row = 0;
  for (const float value : values) {
    for (size_t a = 0; a < 3; ++a) {
      cloud.means[3 * row++ + a] = value;
      cloud.log_scales[3 * row++ + a] = value;
    }
    for (size_t a = 0; a < 4; ++a) cloud.quats[4 * row++ + a] = value;
    cloud.opacity_logits[row++] = value;
    for (const size_t k : {0, 5, 47}) cloud.sh[48 * row++ + k] = value;
  }
  ASSERT_LT(row, 200u);
  RenderOptions options;
  options.depth = true;
  Compare(cloud, RandomCamera(13, 64, 64), options);
  for (const RenderMode mode : kRenderModes) {
    options.mode = mode;
    options.sh_degree = 1;  // the last coefficient is not looked at
    options.profile = RasterProfile::kGsplat15;
    Compare(cloud, RandomCamera(14, 50, 64), options);
  }
}

TEST_F(GpuRasterizerTest, ShapesBeyondTheRangeOfFloats) {
  GaussianCloud cloud = RandomCloud(17, {.gaussians = 300});
  Random random(17);
  for (size_t i = 0; i < 200; ++i) {
    for (size_t a = 0; a < 3; ++a) {
      if (i % 2 == 0) cloud.log_scales[3 * i + a] = static_cast<float>(random.Uniform(-60, 44));
    }
    const float norm = static_cast<float>(std::pow(10.0, random.Uniform(-30, 18)));
    for (size_t a = 0; a < 4; ++a) {
      if (i % 3 == 0) cloud.quats[4 * i + a] *= norm;
      if (i % 17 == 0) cloud.quats[4 * i + a] = 0;
    }
    if (i % 19 == 0) cloud.log_scales[3 * i + 1] = -kInfinity;
    if (i % 23 == 0) cloud.means[3 * i] *= 1e12f;
    if (i % 29 == 0) cloud.sh[48 * i + 4] *= 1e33f;
  }
  RenderOptions options;
  options.depth = true;
  for (const float dilation : {0.0f, 0.3f}) {
    for (const RenderMode mode : kRenderModes) {
      options.mode = mode;
      options.dilation = dilation;
      Compare(cloud, RandomCamera(18, 64, 48), options);
    }
  }
}

// Needles across the picture, one Gaussian before all of it, and some right before the camera.
TEST_F(GpuRasterizerTest, LargeGaussians) {
  GaussianCloud cloud = RandomCloud(19, {.gaussians = 300, .smallest = 0.0005, .largest = 20});
  Compare(cloud, RandomCamera(19, 250, 170), {});
  cloud.means[0] = cloud.means[1] = 0, cloud.means[2] = 0.0101f;
  cloud.means[3] = 1e-5f, cloud.means[4] = 0, cloud.means[5] = 0.011f;
  Compare(cloud, FrontCamera(250, 170, 200), {});
}

// Far from the world's origin floats have no digits left for a place, but both devices see the same.
TEST_F(GpuRasterizerTest, FarFromTheOrigin) {
  GaussianCloud cloud = RandomCloud(23, {.gaussians = 300});
  Camera camera = RandomCamera(23, 64, 64);
  const std::array<double, 3> move = {3000, -2000, 1000};
  for (size_t i = 0; i < 900; ++i) cloud.means[i] += static_cast<float>(move[i % 3]);
  Pose& pose = camera.world_to_camera;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) pose.translation[i] -= pose.rotation[3 * i + j] * move[j];
  }
  Compare(cloud, camera, {});
}

TEST_F(GpuRasterizerTest, ACameraBeyondTheRangeOfFloatsIsForTheCpu) {
  const GaussianCloud cloud = RandomCloud(29, {.gaussians = 10});
  GpuCloud uploaded;
  ASSERT_TRUE(uploaded.Assign(*gpu_->device, cloud).ok());
  Camera camera = RandomCamera(29, 16, 16);
  RenderOutput output = test::PictureFor(camera, false);
  camera.world_to_camera.translation[0] = 1e20;
  const Result<bool> drawn = gpu_->Draw(uploaded, camera, kNear, {}, &output);
  ASSERT_TRUE(drawn.ok()) << drawn.error().message;
  EXPECT_FALSE(*drawn);
}

TEST_F(GpuRasterizerTest, TheSameBitsAtEveryRunAndInEveryRasterizer) {
  const GaussianCloud cloud = RandomCloud(31, {.gaussians = 700});
  const Camera camera = RandomCamera(31, 90, 61);
  RenderOptions options;
  options.depth = true;
  const RenderOutput first = DrawOnGpu(*gpu_, cloud, camera, options);
  DrawOnGpu(*gpu_, RandomCloud(32), RandomCamera(32, 100, 100), {});
  EXPECT_TRUE(SameBits(first, DrawOnGpu(*gpu_, cloud, camera, options)));
  GpuRasterizer other(gpu_->device);
  EXPECT_TRUE(SameBits(first, DrawOnGpu(other, cloud, camera, options)));
  // Nor do runs of tiles change a pixel.
  EXPECT_EQ(gpu_->runs, 1);
  options.max_pairs = 300;
  GpuRasterizer third(gpu_->device);
  EXPECT_TRUE(SameBits(first, DrawOnGpu(third, cloud, camera, options)));
  EXPECT_GT(third.runs, 3);
}

// A picture that stays there is the one that is read.
TEST_F(GpuRasterizerTest, APictureThatStaysOnTheGpu) {
  const GaussianCloud cloud = RandomCloud(37, {.gaussians = 200});
  const Camera camera = RandomCamera(37, 48, 33);
  RenderOptions options;
  options.gradient = true;
  const RenderOutput expected = DrawOnGpu(*gpu_, cloud, camera, options);
  Result<GpuCloud> resident = GpuCloud::Create(*gpu_->device, cloud.size(), cloud.sh_degree);
  ASSERT_TRUE(resident.ok());
  resident->Write(*gpu_->device, cloud);
  const Result<bool> drawn = gpu_->Draw(*resident, camera, kNear, options, nullptr);
  ASSERT_TRUE(drawn.ok() && *drawn);
  const size_t plane = static_cast<size_t>(gpu_->PlanePixels());
  const std::vector<float> picture = test::ReadBack<float>(*gpu_->device, *gpu_->picture, 5 * plane);
  for (size_t c = 0; c < 3; ++c) {
    for (size_t i = 0; i < 48 * 33; ++i) ASSERT_EQ(picture[c * plane + i], expected.color.pixels[c * 48 * 33 + i]);
  }
}

}  // namespace
}  // namespace anchorsplat
