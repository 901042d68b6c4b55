#pragma once

#include <cmath>
#include <filesystem>
#include <numbers>
#include <string>

#include "cameras/camera_io.h"
#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/random.h"
#include "images/image_io.h"
#include "render/rasterizer.h"

// A project on disk with pictures of a known splat.
namespace anchorsplat::orbit_scene {

// Coloured Gaussians in a ball of radius 0.5.
inline GaussianCloud Ball(int64_t n, uint64_t seed) {
  GaussianCloud cloud;
  cloud.Resize(n, 0);
  Random random(seed);
  for (size_t i = 0; i < static_cast<size_t>(n); ++i) {
    for (size_t a = 0; a < 3; ++a) {
      cloud.means[3 * i + a] = static_cast<float>(random.Uniform(-0.3, 0.3));
      cloud.log_scales[3 * i + a] = static_cast<float>(random.Uniform(-3.2, -2.2));
      cloud.sh[3 * i + a] = static_cast<float>(random.Uniform(-1, 1.5));
    }
    for (size_t a = 0; a < 4; ++a) cloud.quats[4 * i + a] = static_cast<float>(random.Normal());
    cloud.opacity_logits[i] = static_cast<float>(random.Uniform(0, 3));
  }
  return cloud;
}

inline CameraSet Cameras(int views, int width, int height) {
  CameraSet set = OrbitCameras(views, 1.7, {0, 0, 0}, PinholeFromFov(width, height, std::numbers::pi / 4)).value();
  for (Camera& camera : set.cameras) camera.name = "views/" + camera.name;
  return set;
}

// views/*.png of `cloud` on black, and transforms.json, in `folder`.
inline CameraSet Write(const std::filesystem::path& folder, const GaussianCloud& cloud, int views, int side) {
  const CameraSet set = Cameras(views, side, side);
  std::filesystem::create_directories(folder / "views");
  Rasterizer rasterizer;
  RenderOutput output;
  for (const Camera& camera : set.cameras) {
    (void)rasterizer.Render(cloud, camera, {}, output);
    (void)WritePng(folder / (camera.name + ".png"), output.color);
  }
  (void)WriteTransforms(folder / "transforms.json", set);
  return set;
}

}  // namespace anchorsplat::orbit_scene
