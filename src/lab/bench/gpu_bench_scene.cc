#include "bench/gpu_bench_scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/random.h"

namespace anchorsplat {

GaussianCloud GpuBenchCloud(int64_t count, uint64_t seed) {
  GaussianCloud cloud;
  cloud.Resize(count, 3);
  Random random(seed);
  const double size = 1.2 / std::sqrt(static_cast<double>(std::max<int64_t>(count, 1)));
  const auto stride = static_cast<size_t>(cloud.sh_stride());
  for (size_t i = 0; i < static_cast<size_t>(count); ++i) {
    const double z = random.Uniform(-1, 1), around = random.Uniform(0, 2 * std::numbers::pi);
    const double across = std::sqrt(1 - z * z);
    const std::array<double, 3> at = {across * std::cos(around), across * std::sin(around), z};
    const double bumps = std::sin(5 * at[0]) * std::sin(4 * at[1]) * std::sin(6 * at[2]);
    const double radius = 0.5 + 0.05 * bumps + 0.01 * random.Normal();
    for (size_t a = 0; a < 3; ++a) {
      cloud.means[3 * i + a] = static_cast<float>(radius * at[a]);
      cloud.log_scales[3 * i + a] = static_cast<float>(std::log(size) + random.Uniform(-1.5, 0.5));
    }
    for (size_t a = 0; a < 4; ++a) cloud.quats[4 * i + a] = static_cast<float>(random.Normal());
    cloud.opacity_logits[i] = static_cast<float>(2 * random.Normal());
    float* sh = &cloud.sh[stride * i];
    for (size_t k = 0; k < 3; ++k) sh[k] = static_cast<float>(1.5 * at[k] + random.Uniform(-0.3, 0.3));
    for (size_t k = 3; k < stride; ++k) sh[k] = static_cast<float>(random.Uniform(-0.1, 0.1));
  }
  return cloud;
}

Result<Camera> GpuBenchCamera(int width, int height) {
  constexpr double kShorter = std::numbers::pi / 4;
  const double wide = static_cast<double>(width) / std::min(width, height);
  Camera camera;
  camera.intrinsics = PinholeFromFov(width, height, 2 * std::atan(wide * std::tan(kShorter / 2)));
  ANCHORSPLAT_ASSIGN_OR_RETURN(camera.world_to_camera, LookAt({0.9, -0.6, 1.3}, {0, 0, 0}, {0, -1, 0}));
  return camera;
}

RenderGradient GpuBenchWeights(int width, int height, uint64_t seed) {
  RenderGradient weights;
  Random random(seed);
  const auto fill = [&](int channels, Image& image) {
    image.width = width, image.height = height, image.channels = channels;
    image.pixels.resize(static_cast<size_t>(channels) * static_cast<size_t>(image.plane()));
    for (float& pixel : image.pixels) pixel = static_cast<float>(random.Uniform(-1, 1));
  };
  fill(3, weights.color), fill(1, weights.alpha);
  return weights;
}

}  // namespace anchorsplat
