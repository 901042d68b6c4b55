#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <utility>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/log.h"
#include "core/random.h"

namespace anchorsplat {

// Records log messages during its lifetime.
class LogRecorder : public LogSink {
 public:
  static std::shared_ptr<LogRecorder> Install() {
    auto recorder = std::make_shared<LogRecorder>();
    recorder->before_ = SetLogSink(recorder);
    return recorder;
  }
  void Restore() { SetLogSink(before_); }
  void Message(LogLevel, const std::string& text) override { text_ += text + "\n"; }
  void TaskBegin(const std::string&, int64_t) override {}
  void TaskProgress(int64_t, const std::string&) override {}
  void TaskEnd() override {}
  bool Says(const std::string& what) const { return text_.find(what) != std::string::npos; }
  const std::string& text() const { return text_; }

 private:
  std::shared_ptr<LogSink> before_;
  std::string text_;
};

class EnhanceTest : public testing::Test {
 protected:
  void SetUp() override { log_ = LogRecorder::Install(); }
  void TearDown() override { log_->Restore(); }
  std::shared_ptr<LogRecorder> log_;
};

// A ball of opaque discs on its surface, eroded as a fit with pixels of size `pixel` leaves them: variance 0.3 px² is
// removed from discs that closed the surface.
inline GaussianCloud Ball(double pixel, int64_t n = 6000) {
  GaussianCloud cloud;
  cloud.Resize(n, 0);
  Random random(11), opacities(12);
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  const double spacing = std::sqrt(4 * std::numbers::pi * 0.25 / static_cast<double>(n));  // radius one half
  for (size_t i = 0; i < static_cast<size_t>(n); ++i) {
    const double y = 1 - 2 * (static_cast<double>(i) + 0.5) / static_cast<double>(n), ring = std::sqrt(1 - y * y);
    const double x = ring * std::cos(golden * static_cast<double>(i)),
                 z = ring * std::sin(golden * static_cast<double>(i));
    cloud.means[3 * i] = static_cast<float>(0.5 * x);
    cloud.means[3 * i + 1] = static_cast<float>(0.5 * y);
    cloud.means[3 * i + 2] = static_cast<float>(0.5 * z);
    // Rotates z onto the normal.
    const double w = std::sqrt(0.5 * (1 + z)), s = w > 1e-6 ? 0.5 / w : 0;
    cloud.quats[4 * i] = static_cast<float>(w);
    cloud.quats[4 * i + 1] = static_cast<float>(-y * s);
    cloud.quats[4 * i + 2] = static_cast<float>(x * s);
    cloud.quats[4 * i + 3] = 0;
    const double width = 0.9 * spacing * (1 + 0.2 * random.Normal());
    double eroded = std::sqrt(std::max(0.01 * width * width, width * width - 0.3 * pixel * pixel));
    if (i % 16 == 0) eroded *= random.Uniform(0.01, 1);  // fits shrink some to nothing
    cloud.log_scales[3 * i] = cloud.log_scales[3 * i + 1] = static_cast<float>(std::log(eroded));
    cloud.log_scales[3 * i + 2] = -9;
    cloud.opacity_logits[i] = i % 4 == 1 ? static_cast<float>(opacities.Uniform(-2, 2.9)) : 2.9f;  // 0.948
    for (size_t c = 0; c < 3; ++c) cloud.sh[3 * i + c] = static_cast<float>(random.Uniform(-1, 1));
  }
  return cloud;
}

inline CameraSet CamerasForPixel(double pixel) {
  const Pinhole intrinsics = PinholeFromFov(256, 256, std::numbers::pi / 4);
  auto cameras = OrbitCameras(20, pixel * intrinsics.fx + 0.5, {0, 0, 0}, intrinsics);  // nearest point of the ball
  return std::move(cameras).value();
}

}  // namespace anchorsplat
