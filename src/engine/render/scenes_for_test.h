#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <numbers>
#include <string>
#include <vector>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/random.h"
#include "core/source_dir_for_test.h"
#include "render/rasterizer.h"

// Clouds and cameras for the tests of render/.
namespace anchorsplat::test {

struct SceneShape {
  int64_t gaussians = 500;
  int degree = 3;
  double smallest = 0.005, largest = 0.3;  // scales, world units; the camera is 3 units away
};

// Gaussians of all shapes in a ball of radius 1, and some around the camera.
inline GaussianCloud RandomCloud(uint64_t seed, const SceneShape& shape = {}) {
  GaussianCloud cloud;
  cloud.Resize(shape.gaussians, shape.degree);
  Random random(seed);
  for (size_t i = 0; i < static_cast<size_t>(shape.gaussians); ++i) {
    const double spread = i % 10 == 9 ? 4.0 : 1.0;  // every tenth anywhere, also behind the camera or off the image
    for (size_t a = 0; a < 3; ++a) {
      cloud.means[3 * i + a] = static_cast<float>(spread * random.Uniform(-1, 1));
      cloud.log_scales[3 * i + a] =
          static_cast<float>(random.Uniform(std::log(shape.smallest), std::log(shape.largest)));
    }
    for (size_t a = 0; a < 4; ++a) cloud.quats[4 * i + a] = static_cast<float>(random.Normal());
    cloud.opacity_logits[i] = static_cast<float>(random.Uniform(-6, 6));
  }
  for (float& c : cloud.sh) c = static_cast<float>(0.4 * random.Normal());
  return cloud;
}

// A camera 3 units from the origin in a random direction, with an off-centre principal point and fx ≠ fy.
inline Camera RandomCamera(uint64_t seed, int width, int height) {
  Random random(seed ^ 0x9e3779b97f4a7c15ull);
  const double theta = random.Uniform(0, 2 * std::numbers::pi), y = random.Uniform(-0.9, 0.9);
  const double ring = std::sqrt(1 - y * y);
  Camera camera;
  camera.world_to_camera =
      LookAt({3 * ring * std::cos(theta), 3 * y, 3 * ring * std::sin(theta)}, {0.1, -0.05, 0.07}, {0, 1, 0}).value();
  const double focal = random.Uniform(0.8, 1.5) * std::max(width, height);
  camera.intrinsics = {width,
                       height,
                       focal,
                       focal * random.Uniform(0.8, 1.25),
                       width * random.Uniform(0.3, 0.7),
                       height * random.Uniform(0.3, 0.7)};
  return camera;
}

// Camera at the origin looking along +z.
inline Camera FrontCamera(int width, int height, double focal) {
  Camera camera;
  camera.intrinsics = {width, height, focal, focal, 0.5 * width, 0.5 * height};
  return camera;
}

// One white-ish isotropic Gaussian of SH degree 0.
inline GaussianCloud OneGaussian(double x, double y, double z, double scale, double opacity,
                                 std::array<float, 3> rgb = {0.9f, 0.5f, 0.2f}) {
  GaussianCloud cloud;
  cloud.Resize(1, 0);
  cloud.means = {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
  cloud.log_scales.assign(3, static_cast<float>(std::log(scale)));
  cloud.quats = {1, 0, 0, 0};
  cloud.opacity_logits = {static_cast<float>(std::log(opacity / (1 - opacity)))};
  for (size_t c = 0; c < 3; ++c) cloud.sh[c] = (rgb[c] - 0.5f) / 0.28209479177387814f;
  return cloud;
}

// Reads a splat of examples/: binary little-endian PLY with exactly 62 floats per Gaussian in INRIA's order. Empty
// otherwise.
inline GaussianCloud ReadExample(const std::string& name) {
  GaussianCloud cloud;
  std::ifstream file(SourceDirForTest().string() + "/examples/" + name + "/input.ply", std::ios::binary);
  int64_t count = 0;
  int properties = 0;
  for (std::string line; std::getline(file, line) && line != "end_header";) {
    if (line.rfind("element vertex ", 0) == 0) count = std::stoll(line.substr(15));
    properties += line.rfind("property float ", 0) == 0;
  }
  if (properties != 62 || count <= 0) return cloud;
  std::vector<float> rows(static_cast<size_t>(count) * 62);
  file.read(reinterpret_cast<char*>(rows.data()), static_cast<std::streamsize>(rows.size() * sizeof(float)));
  if (!file) return cloud;
  cloud.Resize(count, 3);
  for (size_t i = 0; i < static_cast<size_t>(count); ++i) {
    const float* r = rows.data() + 62 * i;  // x y z, normal, dc, rest (channel-major), opacity, scale, rot
    std::copy_n(r, 3, &cloud.means[3 * i]);
    for (size_t c = 0; c < 3; ++c) {
      cloud.sh[48 * i + c] = r[6 + c];
      for (size_t k = 1; k < 16; ++k) cloud.sh[48 * i + 3 * k + c] = r[9 + 15 * c + k - 1];
    }
    cloud.opacity_logits[i] = r[54];
    std::copy_n(r + 55, 3, &cloud.log_scales[3 * i]);
    std::copy_n(r + 58, 4, &cloud.quats[4 * i]);
  }
  return cloud;
}

}  // namespace anchorsplat::test
