#include "train/augmentation.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/parallel.h"
#include "core/rotation.h"
#include "core/sh_rotation.h"
#include "core/spherical_harmonics.h"

namespace anchorsplat {

namespace {

constexpr int64_t kRowsPerTask = 4096;

std::array<double, 9> Product(const std::array<double, 9>& a, const std::array<double, 9>& b) {
  std::array<double, 9> out{};
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) {
      for (size_t k = 0; k < 3; ++k) out[3 * i + j] += a[3 * i + k] * b[3 * k + j];
    }
  }
  return out;
}

std::array<double, 9> Transposed(const std::array<double, 9>& m) {
  return {m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]};
}

void FlipLeftRight(TrueView& view) {
  Image& image = view.picture;
  for (int64_t row = 0; row < int64_t{image.channels} * image.height; ++row) {
    float* begin = image.pixels.data() + row * image.width;
    std::reverse(begin, begin + image.width);
  }
  for (auto row = view.ignored.begin(); row != view.ignored.end(); row += image.width) {
    std::reverse(row, row + image.width);
  }
  const auto flip = [&](PixelBox& box) {
    if (!box.empty()) box = {image.width - box.x1, box.y0, image.width - box.x0, box.y1};
  };
  flip(view.object);
  flip(view.perceptual);
}

void DropGaussians(double share, Random& random, AugmentedScene& scene) {
  std::vector<int64_t> rows;
  Buffer<float> sizes;
  for (int64_t i = 0; i < scene.cloud.size(); ++i) {
    if (random.Uniform() < share) continue;
    rows.push_back(i);
    sizes.push_back(scene.pixel_sizes[static_cast<size_t>(i)]);
  }
  if (rows.empty()) return;
  auto kept = Subset(scene.cloud, rows);  // cannot fail: rows are in range
  scene.cloud = *std::move(kept);
  scene.pixel_sizes = std::move(sizes);
}

}  // namespace

void RotateWorld(const std::array<double, 4>& q, AugmentedScene& scene) {
  const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  const double w = q[0] / norm, x = q[1] / norm, y = q[2] / norm, z = q[3] / norm;
  const std::array<double, 9> r = RotationFromQuaternion(w, x, y, z);
  const ShRotation harmonics(r);
  GaussianCloud& cloud = scene.cloud;
  ParallelFor(0, cloud.size(), kRowsPerTask, [&](int64_t first, int64_t last) {
    for (int64_t i = first; i < last; ++i) {
      float* m = cloud.means.data() + 3 * i;
      const double p[3] = {m[0], m[1], m[2]};
      for (size_t a = 0; a < 3; ++a) {
        m[a] = static_cast<float>(r[3 * a] * p[0] + r[3 * a + 1] * p[1] + r[3 * a + 2] * p[2]);
      }
      float* own = cloud.quats.data() + 4 * i;
      const double b[4] = {own[0], own[1], own[2], own[3]};
      own[0] = static_cast<float>(w * b[0] - x * b[1] - y * b[2] - z * b[3]);
      own[1] = static_cast<float>(w * b[1] + x * b[0] + y * b[3] - z * b[2]);
      own[2] = static_cast<float>(w * b[2] - x * b[3] + y * b[0] + z * b[1]);
      own[3] = static_cast<float>(w * b[3] + x * b[2] - y * b[1] + z * b[0]);
      harmonics.Apply(cloud.sh.data() + i * cloud.sh_stride(), cloud.sh_degree);
    }
  });
  for (Camera& camera : scene.cameras) {
    camera.world_to_camera.rotation = Product(camera.world_to_camera.rotation, Transposed(r));
  }
}

// With M = diag(−1, 1, 1), means become M·p. Covariances M·R·S·Sᵀ·Rᵀ·M have rotation M·R·M, because S is diagonal. A
// mirrored camera would be left-handed, so pictures are mirrored too: F·R·M with F = M is a rotation again.
void MirrorWorld(AugmentedScene& scene) {
  const ShRotation harmonics({-1, 0, 0, 0, 1, 0, 0, 0, 1});
  GaussianCloud& cloud = scene.cloud;
  ParallelFor(0, cloud.size(), kRowsPerTask, [&](int64_t first, int64_t last) {
    for (int64_t i = first; i < last; ++i) {
      cloud.means[static_cast<size_t>(3 * i)] *= -1;
      cloud.quats[static_cast<size_t>(4 * i + 2)] *= -1;
      cloud.quats[static_cast<size_t>(4 * i + 3)] *= -1;
      harmonics.Apply(cloud.sh.data() + i * cloud.sh_stride(), cloud.sh_degree);
    }
  });
  for (size_t v = 0; v < scene.cameras.size(); ++v) {
    Camera& camera = scene.cameras[v];
    Pose& pose = camera.world_to_camera;
    for (const size_t k : {1, 2, 3, 6}) pose.rotation[k] *= -1;  // F from the left, M from the right
    pose.translation[0] *= -1;
    camera.intrinsics.cx = camera.intrinsics.width - camera.intrinsics.cx;
    FlipLeftRight(scene.truth[v]);
  }
}

void ScaleWorld(double factor, AugmentedScene& scene) {
  const auto scale = static_cast<float>(factor), log_scale = static_cast<float>(std::log(factor));
  for (float& m : scene.cloud.means) m *= scale;
  for (float& s : scene.cloud.log_scales) s += log_scale;
  for (float& p : scene.pixel_sizes) p *= scale;
  for (Camera& camera : scene.cameras) {
    for (double& t : camera.world_to_camera.translation) t *= factor;
  }
}

void ChangeColors(const std::array<size_t, 3>& order, const std::array<double, 3>& gain, AugmentedScene& scene) {
  GaussianCloud& cloud = scene.cloud;
  const int64_t coefficients = cloud.size() * cloud.coefficients();
  for (int64_t k = 0; k < coefficients; ++k) {
    float* sh = cloud.sh.data() + 3 * k;
    const float old[3] = {sh[0], sh[1], sh[2]};
    // colour = max(Σ c·Y + 0.5, 0). A positive factor passes through the maximum; the 0.5 goes into the DC.
    const bool dc = k % cloud.coefficients() == 0;
    for (size_t c = 0; c < 3; ++c) {
      const double moved = dc ? 0.5 * (gain[c] - 1) / static_cast<double>(kSh0) : 0;
      sh[c] = static_cast<float>(gain[c] * static_cast<double>(old[order[c]]) + moved);
    }
  }
  for (TrueView& view : scene.truth) {
    Image changed(view.picture.width, view.picture.height, 3);
    const auto background = view.background;
    for (size_t c = 0; c < 3; ++c) {
      const auto factor = static_cast<float>(gain[c]);
      const float* from = view.picture.channel(static_cast<int>(order[c]));
      std::transform(from, from + changed.plane(), changed.channel(static_cast<int>(c)),
                     [factor](float v) { return factor * v; });
      view.background[c] = factor * background[order[c]];
    }
    view.picture = std::move(changed);
  }
}

void Augment(const AugmentationConfig& config, Random& random, AugmentedScene& scene) {
  if (config.drop > 0) DropGaussians(random.Uniform(0, config.drop), random, scene);
  if (config.rotate) {
    // A normalised vector of four normal numbers is a uniform rotation.
    RotateWorld({random.Normal(), random.Normal(), random.Normal(), random.Normal()}, scene);
  }
  if (config.mirror && random.Uniform() < 0.5) MirrorWorld(scene);
  if (config.scale > 0) ScaleWorld(std::exp(config.scale * std::clamp(random.Normal(), -2.0, 2.0)), scene);
  if (config.permute_colors || config.gain > 0) {
    std::array<size_t, 3> order = {0, 1, 2};
    if (config.permute_colors) {
      for (size_t i = 0; i < 2; ++i) {
        std::swap(order[i], order[i + static_cast<size_t>(random.Below(static_cast<int64_t>(3 - i)))]);
      }
    }
    std::array<double, 3> gain = {1, 1, 1};
    // Gains of 0 would leave nothing visible.
    if (config.gain > 0) {
      for (double& g : gain) g = std::max(0.05, 1 - config.gain * random.Uniform());
    }
    ChangeColors(order, gain, scene);
  }
  if (config.opacity_noise > 0) {
    for (float& logit : scene.cloud.opacity_logits) logit += static_cast<float>(config.opacity_noise * random.Normal());
  }
  if (config.pixel_size_noise > 0) {
    const auto factor = static_cast<float>(std::exp(config.pixel_size_noise * std::clamp(random.Normal(), -3.0, 3.0)));
    for (float& p : scene.pixel_sizes) p *= factor;
  }
  if (config.strength_noise > 0) {
    scene.strength *= std::exp(config.strength_noise * std::clamp(random.Normal(), -3.0, 3.0));
  }
}

}  // namespace anchorsplat
