#include "fit/gpu_objective.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "core/random.h"
#include "fit/orbit_scene_for_test.h"
#include "gpu/gpu_for_test.h"
#include "metrics/image_metrics.h"

namespace anchorsplat {
namespace {

constexpr std::array<float, 3> kBackground = {0.2f, 0.5f, 1};

double RelativeDifference(const std::vector<float>& a, const Buffer<float>& b) {
  EXPECT_EQ(a.size(), b.size());
  double off = 0, size = 0;
  for (size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    off += std::pow(double{a[i]} - b[i], 2);
    size += std::pow(double{b[i]}, 2);
  }
  return std::sqrt(off / size);
}

class GpuObjectives : public testing::Test {
 protected:
  void SetUp() override {
    device_ = GpuForTest();
    ASSERT_NE(device_, nullptr);
    host_ = orbit_scene::Ball(30, 1);
    camera_ = orbit_scene::Cameras(2, 37, 29).cameras[1];
    auto made = GpuCloud::Create(*device_, host_.size(), host_.sh_degree);
    ASSERT_TRUE(made.ok());
    cloud_ = std::move(made).value();
    cloud_.Write(*device_, host_);
  }

  std::shared_ptr<GpuDevice> device_;
  GaussianCloud host_;
  GpuCloud cloud_;
  Camera camera_;
};

TEST_F(GpuObjectives, AreThoseOfTheCpu) {
  const size_t plane = 37 * 29;
  for (const PixelModel& pixel : {PixelModel{1, 1}, PixelModel{2, 2}, PixelModel{1, 3}}) {
    for (const int channels : {3, 4}) {
      for (const bool masked : {false, true}) {
        SCOPED_TRACE(testing::Message() << pixel.samples << " rays, " << channels << " channels, masked " << masked);
        Random random(5);
        std::vector<uint8_t> bytes(static_cast<size_t>(channels) * plane);
        for (uint8_t& byte : bytes) byte = static_cast<uint8_t>(random.Below(256));
        Buffer<uint8_t> ignored(masked ? plane : 0);
        for (size_t i = 0; i < ignored.size(); ++i) ignored[i] = i % 7 < 3;
        Image picture(37, 29, 3);
        for (size_t i = 0; i < 3 * plane; ++i) {
          const float alpha = channels == 4 ? static_cast<float>(bytes[3 * plane + i % plane]) / 255 : 1;
          picture.pixels[i] = static_cast<float>(bytes[i]) / 255 * alpha + kBackground[i / plane] * (1 - alpha);
        }
        ObjectiveOptions options;
        options.pixel = pixel;
        ViewObjective here;
        CloudGradient expected;
        ASSERT_TRUE(here.Show(options, host_, camera_).ok());
        Image filled = picture;
        FillIgnored(ignored, here.rendered(), filled);
        const PhotometricLossValue loss = here.Compare(options, host_, filled, expected).value();

        // As bytes and as floats; kept and not.
        for (const bool packed : {true, false}) {
          GpuObjective there(device_);
          EXPECT_FALSE(there.Holds(3));
          const Result<bool> drawn = there.Show(options, cloud_, {}, camera_);
          ASSERT_TRUE(drawn.ok() && *drawn);
          const Status set =
              packed ? there.SetTarget({channels, bytes, ignored}, kBackground, 3) : there.SetTarget(picture, ignored);
          ASSERT_TRUE(set.ok());
          EXPECT_EQ(there.Holds(3), packed);
          std::vector<float> means(expected.means.size()), logits(expected.opacity_logits.size());
          ASSERT_TRUE(
              there
                  .Compare(options, cloud_, 3,
                           [&](const GpuGradient& gradient) {
                             const std::array<GpuRead, 2> reads = {
                                 {{gradient.means.get(), 0, std::as_writable_bytes(std::span(means))},
                                  {gradient.opacity_logits.get(), 0, std::as_writable_bytes(std::span(logits))}}};
                             return device_->Read(reads);
                           })
                  .ok());
          EXPECT_NEAR(there.Loss()->loss.loss, loss.loss, 1e-5 * loss.loss);
          EXPECT_LT(RelativeDifference(means, expected.means), 1e-3);
          EXPECT_LT(RelativeDifference(logits, expected.opacity_logits), 1e-3);
          const Result<const Image*> rendered = there.Rendered();
          ASSERT_TRUE(rendered.ok());
          for (size_t i = 0; i < 3 * plane; ++i) {
            ASSERT_NEAR((*rendered)->pixels[i], here.rendered().pixels[i], 1e-4) << i;
          }
        }
      }
    }
  }
}

TEST_F(GpuObjectives, RefuseWhatTheRasterizerRefuses) {
  GpuObjective objective(device_);
  Camera camera = camera_;
  camera.intrinsics.fx = 0;
  EXPECT_FALSE(objective.Show({}, cloud_, {}, camera).ok());
  ObjectiveOptions options;
  options.pixel = {3, 2};
  EXPECT_FALSE(objective.Show(options, cloud_, {}, camera_).ok());
}

}  // namespace
}  // namespace anchorsplat
