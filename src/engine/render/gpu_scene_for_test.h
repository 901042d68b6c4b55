#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "core/camera.h"
#include "gpu/gpu_for_test.h"
#include "render/gpu_rasterizer.h"
#include "render/rasterizer.h"
#include "render/shown_range.h"

// Draws pictures on CPU and GPU for comparison.
namespace anchorsplat::test {

inline RenderOutput DrawOnCpu(const CloudView& cloud, const Camera& camera, const RenderOptions& options,
                              RenderStatistics* statistics = nullptr) {
  Rasterizer rasterizer;
  RenderOutput output;
  const Status status = rasterizer.Render(cloud, camera, options, output);
  EXPECT_TRUE(status.ok()) << status.error().message;
  if (statistics != nullptr) *statistics = rasterizer.statistics();
  return output;
}

inline RenderOutput PictureFor(const Camera& camera, bool depth) {
  RenderOutput output;
  const auto shape = [&](int channels, Image& image) {
    image.width = camera.intrinsics.width, image.height = camera.intrinsics.height, image.channels = channels;
    image.pixels.resize(static_cast<size_t>(channels) * static_cast<size_t>(image.plane()));
    for (float& pixel : image.pixels) pixel = -1;  // makes unwritten pixels visible
  };
  shape(3, output.color), shape(1, output.alpha);
  if (depth) shape(1, output.depth);
  return output;
}

// Draws with the kernels only, without Rasterizer's fallback to the CPU.
inline RenderOutput DrawOnGpu(GpuRasterizer& gpu, const CloudView& cloud, const Camera& camera,
                              const RenderOptions& options) {
  RenderOutput output = PictureFor(camera, options.depth);
  GpuCloud uploaded;
  const Status status = uploaded.Assign(*gpu.device, cloud);
  EXPECT_TRUE(status.ok()) << status.error().message;
  if (!status.ok()) return output;
  const Result<bool> drawn = gpu.Draw(uploaded, camera, NearPlane(options, camera), options, &output);
  EXPECT_TRUE(drawn.ok()) << drawn.error().message;
  EXPECT_TRUE(!drawn.ok() || *drawn);
  return output;
}

// Differences between two pictures. A few values may exceed the tolerance, as rounding decides pixels right at a
// cut-off.
struct Tally {
  int64_t values = 0, beyond = 0;  // 1e-4
  double largest = 0;              // of those within 1e-4

  void Add(const Image& a, const Image& b) {
    ASSERT_EQ(a.pixels.size(), b.pixels.size());
    for (size_t i = 0; i < a.pixels.size(); ++i) {
      const double scale = std::max(1.0, std::abs(double{a.pixels[i]}));
      const double difference = std::abs(double{a.pixels[i]} - double{b.pixels[i]}) / scale;
      ++values;
      if (difference <= 1e-4) {
        largest = std::max(largest, difference);
      } else {
        ++beyond;  // also NaN
      }
    }
  }
  void Add(const RenderOutput& a, const RenderOutput& b) {
    Add(a.color, b.color), Add(a.alpha, b.alpha), Add(a.depth, b.depth);
  }
  void ExpectEqual() const {
    EXPECT_LE(static_cast<double>(beyond), 5e-5 * static_cast<double>(values)) << "of " << values;
    EXPECT_GT(values, 0);
  }
};

inline bool SameBits(const Image& a, const Image& b) {
  return a.pixels.size() == b.pixels.size() &&
         (a.pixels.empty() ||  // its data() may be null
          std::memcmp(a.pixels.data(), b.pixels.data(), a.pixels.size() * sizeof(float)) == 0);
}
inline bool SameBits(const RenderOutput& a, const RenderOutput& b) {
  return SameBits(a.color, b.color) && SameBits(a.alpha, b.alpha) && SameBits(a.depth, b.depth);
}

template <typename T>
std::vector<T> ReadBack(GpuDevice& device, const GpuBuffer& buffer, size_t count) {
  std::vector<T> values(count);
  const GpuRead read = {&buffer, 0, std::as_writable_bytes(std::span(values))};
  const Status status = count > 0 ? device.Read({&read, 1}) : Status();
  EXPECT_TRUE(status.ok()) << status.error().message;
  return values;
}

}  // namespace anchorsplat::test
