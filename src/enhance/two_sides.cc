#include "enhance/two_sides.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "core/activations.h"
#include "core/buffer.h"
#include "core/rotation.h"
#include "core/run_context.h"
#include "core/statistics.h"
#include "enhance/cloud_shape.h"
#include "enhance/gaussian_regions.h"

namespace anchorsplat {

namespace {

constexpr int64_t kPlaces = 512;
constexpr double kLeastAlpha = 1.0 / 255, kMostAlpha = 0.99;
constexpr double kReach = 3.33;  // standard deviations, where an alpha of one is the least
// Of the median size, added to all in squares: what is seen on edge has a width, too.
constexpr double kSoftened = 0.27;
constexpr double kCovered = 0.5;  // places where less than that is covered are none of the thing

// As seen along the thickness.
struct Flat {
  std::array<float, 2> at;
  std::array<float, 3> inverse;  // of the covariance: xx, xy, yy
  float reach;
  float opacity;
};

// Of Gaussians in the order in which a side meets them.
void AddSeen(std::span<const std::pair<float, size_t>> met, const std::vector<float>& alphas,
             std::vector<float>& seen) {
  double left = 1;
  for (const auto& [depth, i] : met) {
    seen[i] += static_cast<float>(left * double{alphas[i]});
    left *= 1 - double{alphas[i]};
  }
}

Flat Flatten(const GaussianCloud& cloud, const PrincipalPlaces& places, double softened, size_t i) {
  const float* q = cloud.quats.data() + 4 * i;
  const auto rotation = RotationFromQuaternion<double>(q[0], q[1], q[2], q[3]);
  std::array<double, 3> covariance{};
  for (size_t a = 0; a < 3; ++a) {
    const double scale = std::exp(double{cloud.log_scales[3 * i + a]});
    const auto along = [&](size_t axis) {
      const auto& v = places.axes[axis];
      return scale * (v[0] * rotation[a] + v[1] * rotation[3 + a] + v[2] * rotation[6 + a]);
    };
    const double x = along(1), y = along(2);
    covariance[0] += x * x;
    covariance[1] += x * y;
    covariance[2] += y * y;
  }
  covariance[0] += softened * softened;
  covariance[2] += softened * softened;
  const double determinant = covariance[0] * covariance[2] - covariance[1] * covariance[1];
  return {.at = {places.along[1][i], places.along[2][i]},
          .inverse = {static_cast<float>(covariance[2] / determinant), static_cast<float>(-covariance[1] / determinant),
                      static_cast<float>(covariance[0] / determinant)},
          .reach = static_cast<float>(kReach * std::sqrt(std::max(covariance[0], covariance[2]))),
          .opacity = Sigmoid(cloud.opacity_logits[i])};
}

}  // namespace

TwoSides TwoSidesOf(const GaussianCloud& cloud) {
  const auto count = static_cast<size_t>(cloud.size());
  if (count == 0) return {};
  const PrincipalPlaces places = AlongPrincipalAxes(cloud);
  Buffer<float> sizes(count);
  for (size_t i = 0; i < count; ++i) {
    const auto [smallest, middle, largest] = AxesOf(cloud, i);
    sizes[i] = static_cast<float>(std::sqrt(middle * largest));
  }
  Buffer<float> values = sizes;
  const double softened = kSoftened * double{Quantile(values, 0.5)};
  if (!(softened > 0)) return {};
  std::vector<Flat> flat(count);
  for (size_t i = 0; i < count; ++i) flat[i] = Flatten(cloud, places, softened, i);

  // One place after the other: sums do not depend on the number of threads.
  std::vector<float> alphas(count), front(count), back(count);
  std::vector<std::pair<float, size_t>> met;
  const int64_t samples = std::min<int64_t>(kPlaces, cloud.size());
  for (int64_t s = 0; s < samples; ++s) {
    const auto& at = flat[static_cast<size_t>(s * cloud.size() / samples)].at;
    LeaveIfAbandoned();
    met.clear();
    double left = 1;
    for (size_t i = 0; i < count; ++i) {
      const Flat& f = flat[i];
      const float x = at[0] - f.at[0], y = at[1] - f.at[1];
      if (!(std::abs(x) < f.reach && std::abs(y) < f.reach)) continue;
      const double power = double{f.inverse[0] * x * x + 2 * f.inverse[1] * x * y + f.inverse[2] * y * y};
      const double alpha = std::min(kMostAlpha, double{f.opacity} * std::exp(-0.5 * power));
      if (!(alpha >= kLeastAlpha)) continue;
      alphas[i] = static_cast<float>(alpha);
      left *= 1 - alpha;
      met.emplace_back(places.along[0][i], i);
    }
    if (left > 1 - kCovered) continue;
    std::ranges::sort(met);
    AddSeen(met, alphas, front);
    std::ranges::reverse(met);
    AddSeen(met, alphas, back);
  }

  double least = 0, most = 0, front_sum = 0, back_sum = 0, front_size = 0, back_size = 0;
  for (size_t i = 0; i < count; ++i) {
    const double f = double{front[i]}, b = double{back[i]};
    if (!(f + b > 0 && sizes[i] > 0 && std::isfinite(sizes[i]))) continue;
    least += std::min(f, b);
    most += std::max(f, b);
    const double size = std::log(double{sizes[i]});
    front_sum += f;
    back_sum += b;
    front_size += f * size;
    back_size += b * size;
  }
  if (front_sum == 0 || back_sum == 0) return {};
  return {.shared = least / most, .coarser = std::exp(std::abs(front_size / front_sum - back_size / back_sum))};
}

}  // namespace anchorsplat
