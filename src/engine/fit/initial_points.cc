#include "fit/initial_points.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/spherical_harmonics.h"
#include "fit/random_streams.h"

namespace anchorsplat {

namespace {

constexpr int64_t kProbes = 1 << 16;      // random points to find what cameras see
constexpr size_t kCamerasAsked = 64;      // evenly chosen
constexpr int64_t kTriesPerPoint = 1000;  // before giving up on a tiny region

using Point = std::array<double, 3>;

Point PointInBox(Random& random, const Point& low, const Point& high) {
  Point p{};
  for (size_t k = 0; k < 3; ++k) p[k] = random.Uniform(low[k], high[k]);
  return p;
}

void AppendWithRandomColor(const Point& p, Random& random, InitialPoints& points) {
  for (const double x : p) points.positions.push_back(static_cast<float>(x));
  for (int c = 0; c < 3; ++c) points.colors.push_back(static_cast<float>(random.Uniform()));
}

int64_t CamerasThatSee(const Point& p, const std::vector<Camera>& cameras) {
  constexpr double kNearest = 0.01;  // the rasterizer's near plane
  int64_t count = 0;
  const size_t asked = std::min(cameras.size(), kCamerasAsked);
  for (size_t i = 0; i < asked; ++i) {
    const Camera& camera = cameras[i * cameras.size() / asked];
    const Pinhole& k = camera.intrinsics;
    const auto c = camera.ToCamera(p);
    if (c[2] < kNearest) continue;
    const double x = k.fx * c[0] / c[2] + k.cx, y = k.fy * c[1] / c[2] + k.cy;
    if (x >= 0 && x < k.width && y >= 0 && y < k.height) ++count;
  }
  return count;
}

// Appends a position if it fits in float.
bool AppendPosition(const Point& world, const WorldOrigin& origin, InitialPoints& points) {
  const Point p = RelativeToOrigin(world, origin);
  if (!std::ranges::all_of(p, [](double x) { return std::isfinite(static_cast<float>(x)); })) return false;
  for (const double x : p) points.positions.push_back(static_cast<float>(x));
  return true;
}

}  // namespace

InitialPoints PointsOf(std::span<const ColmapPoint> points, const WorldOrigin& origin) {
  InitialPoints out;
  for (const ColmapPoint& point : points) {
    if (!AppendPosition(point.position, origin, out)) continue;
    for (const uint8_t c : point.color) out.colors.push_back(static_cast<float>(c) / 255);
  }
  return out;
}

InitialPoints PointsOf(std::span<const double> positions, std::span<const float> colors, const WorldOrigin& origin) {
  InitialPoints out;
  for (size_t i = 0; i + 2 < positions.size(); i += 3) {
    if (!AppendPosition({positions[i], positions[i + 1], positions[i + 2]}, origin, out)) continue;
    out.colors.insert(out.colors.end(), colors.begin() + static_cast<ptrdiff_t>(i),
                      colors.begin() + static_cast<ptrdiff_t>(i) + 3);
  }
  return out;
}

InitialPoints RandomPoints(int64_t count, double scene_scale, uint64_t seed, double extent) {
  Random random = RandomStream(seed, RandomPurpose::kInitialPoints);
  const double side = extent * scene_scale;
  InitialPoints points;
  for (int64_t i = 0; i < count; ++i) {
    AppendWithRandomColor(PointInBox(random, {-side, -side, -side}, {side, side, side}), random, points);
  }
  return points;
}

InitialPoints RandomPointsInView(int64_t count, const std::vector<Camera>& cameras, double scene_scale, uint64_t seed) {
  Random random = RandomStream(seed, RandomPurpose::kInitialPoints, 1);
  const double side = kRandomExtent * scene_scale;
  Point cube_low{}, cube_high{};
  for (const Camera& camera : cameras) {
    const Point center = camera.Center();
    for (size_t k = 0; k < 3; ++k) cube_low[k] += center[k] / static_cast<double>(cameras.size());
  }
  for (size_t k = 0; k < 3; ++k) cube_high[k] = cube_low[k] + side, cube_low[k] -= side;
  std::vector<Point> probes;
  std::vector<int64_t> seen;
  int64_t most = 0;
  for (int64_t i = 0; i < kProbes; ++i) {
    probes.push_back(PointInBox(random, cube_low, cube_high));
    seen.push_back(CamerasThatSee(probes.back(), cameras));
    most = std::max(most, seen.back());
  }
  if (most == 0) return RandomPoints(count, scene_scale, seed);

  // Box around what is seen well enough: sampling in it wastes less than sampling the cube.
  Point low = cube_high, high = cube_low;
  for (size_t i = 0; i < probes.size(); ++i) {
    if (2 * seen[i] < most) continue;
    for (size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], probes[i][k]);
      high[k] = std::max(high[k], probes[i][k]);
    }
  }
  InitialPoints points;
  for (int64_t tries = 0; points.size() < count && tries < kTriesPerPoint * count; ++tries) {
    const Point p = PointInBox(random, low, high);
    if (2 * CamerasThatSee(p, cameras) >= most) AppendWithRandomColor(p, random, points);
  }
  return points.size() > 0 ? points : RandomPoints(count, scene_scale, seed);
}

InitialPoints PointsOf(const GaussianCloud& cloud, const WorldOrigin& origin) {
  InitialPoints points;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (!IsUsable(cloud, i) || !AppendPosition(ToWorld(cloud.means.data() + 3 * i, cloud.origin), origin, points))
      continue;
    for (int64_t k = 0; k < 3; ++k) {
      const float color = cloud.sh[static_cast<size_t>(cloud.sh_stride() * i + k)] * kSh0 + 0.5f;
      points.colors.push_back(std::clamp(color, 0.0f, 1.0f));
    }
  }
  return points;
}

InitialPoints SubsampleEvenly(const InitialPoints& points, std::optional<int64_t> wanted) {
  const int64_t n = points.size(), count = wanted.value_or(n);
  if (count >= n) return points;
  InitialPoints out;
  for (int64_t i = 0; i < count; ++i) {
    const auto from = static_cast<size_t>(3 * (i * n / count));
    for (size_t k = 0; k < 3; ++k) {
      out.positions.push_back(points.positions[from + k]);
      out.colors.push_back(points.colors[from + k]);
    }
  }
  return out;
}

}  // namespace anchorsplat
