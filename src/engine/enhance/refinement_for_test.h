#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <memory>

#include "cameras/camera_io.h"
#include "core/log.h"
#include "core/random.h"
#include "enhance/filter.h"
#include "enhance/refine.h"
#include "fit/orbit_scene_for_test.h"
#include "fit/pixel_model.h"
#include "images/image_io.h"
#include "io/folder_for_test.h"
#include "metrics/image_metrics.h"
#include "render/rasterizer.h"

namespace anchorsplat {

inline constexpr int kSide = 28, kUpscale = 3;
inline constexpr double kGoodFit = 40;                              // dB of a good splat against the truth
inline constexpr double kPixel = 1.7 / (0.5 * kSide / 0.41421356);  // at the scene's centre

// A splat that is right at three times the resolution (truth_), a project with camera pictures of it, and the splat
// that a fit makes of those pictures: eroded and slightly wrong.
class Refinement : public testing::Test {
 protected:
  void SetUp() override {
    log_ = SetLogSink(MakeTerminalSink(true));
    truth_ = orbit_scene::Ball(150, 1);
    for (float& s : truth_.log_scales) s -= 0.7f;
    cameras_ = orbit_scene::Cameras(12, kSide, kSide);
    std::filesystem::create_directories(project() / "views");
    Rasterizer rasterizer;
    RenderOutput rays;
    Image seen;
    for (const Camera& camera : cameras_.cameras) {
      ASSERT_TRUE(rasterizer.Render(truth_, RaysOf(AreaModel(kUpscale), camera), {}, rays).ok());
      AverageRays(rays.color, kUpscale, seen);
      ASSERT_TRUE(WritePng(project() / (camera.name + ".png"), seen).ok());
    }
    ASSERT_TRUE(WriteTransforms(project() / "transforms.json", cameras_).ok());

    input_.cloud = truth_;
    Random random(4);
    const double eroded = 0.3 * kPixel * kPixel;
    for (size_t i = 0; i < input_.cloud.means.size(); ++i) {
      input_.cloud.means[i] += static_cast<float>(0.15 * kPixel * random.Normal());
      float& s = input_.cloud.log_scales[i];
      const double square = std::exp(2.0 * s) - 0.7 * eroded;
      s = static_cast<float>(0.5 * std::log(std::max(square, 0.1 * eroded)));
    }
    input_.upscale = kUpscale;
    input_.pixel_size = kPixel;
    input_.start = input_.cloud;
    ASSERT_TRUE(
        ApplyFilter(input_.start, std::vector<float>{static_cast<float>(kPixel)}, {.upscale = kUpscale, .strength = {}})
            .ok());
    options_.images = project();
    options_.hold_out = 4;
    options_.steps = 90;
    options_.copies = 1;
  }
  void TearDown() override { SetLogSink(log_); }

  std::filesystem::path project() const { return folder_ / "project"; }

  // PSNR against the truth from new poses at the higher resolution.
  double PsnrCloser(const GaussianCloud& cloud) const {
    Rasterizer rasterizer;
    RenderOutput a, b;
    double sum = 0;
    for (const Camera& camera : orbit_scene::Cameras(5, kSide * kUpscale, kSide * kUpscale).cameras) {
      EXPECT_TRUE(rasterizer.Render(cloud, camera, {}, a).ok());
      EXPECT_TRUE(rasterizer.Render(truth_, camera, {}, b).ok());
      sum += Psnr(a.color, b.color).value() / 5;
    }
    return sum;
  }

  std::shared_ptr<LogSink> log_;
  TestFolder folder_;
  GaussianCloud truth_;
  CameraSet cameras_;
  RefineInput input_;
  RefineOptions options_;
};

}  // namespace anchorsplat
