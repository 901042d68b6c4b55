#include "scene/surface_samples.h"

#include <algorithm>
#include <cmath>

#include "core/random.h"

namespace anchorsplat {

namespace {

constexpr size_t kEyes = 32;
constexpr int64_t kBatch = 4096;
// Enough to find all requested points if a fiftieth of the surface is visible.
constexpr int64_t kDrawsPerPoint = 50;

// Cumulative triangle areas: a uniform number below the total selects triangles in proportion to area.
std::vector<double> CumulativeAreas(const Mesh& mesh) {
  std::vector<double> sums;
  sums.reserve(mesh.triangles.size());
  double sum = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    double e[3], f[3];
    for (size_t k = 0; k < 3; ++k) {
      e[k] = double{mesh.positions[b][k]} - mesh.positions[a][k];
      f[k] = double{mesh.positions[c][k]} - mesh.positions[a][k];
    }
    const double n[3] = {e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]};
    const double area = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    sum += std::isfinite(area) ? area : 0;
    sums.push_back(sum);
  }
  return sums;
}

SurfacePoint DrawPoint(const std::vector<double>& sums, Random& random) {
  const auto found = std::upper_bound(sums.begin(), sums.end(), random.Uniform() * sums.back());
  SurfacePoint point;
  point.triangle = static_cast<uint32_t>(std::min<ptrdiff_t>(found - sums.begin(), std::ssize(sums) - 1));
  double u = random.Uniform(), v = random.Uniform();
  if (u + v > 1) {  // mirrors the other half of the parallelogram
    u = 1 - u;
    v = 1 - v;
  }
  point.u = static_cast<float>(u);
  point.v = static_cast<float>(v);
  return point;
}

}  // namespace

std::vector<SurfaceSample> SampleSurface(const RayTracer& tracer, const CameraSet& cameras, int64_t count,
                                         uint64_t seed) {
  std::vector<SurfaceSample> samples;
  if (cameras.cameras.empty() || count < 1) return samples;
  std::vector<std::array<double, 3>> eyes;
  const size_t total = cameras.cameras.size(), used = std::min(total, kEyes);
  for (size_t i = 0; i < used; ++i) eyes.push_back(cameras.cameras[i * total / used].Center());
  const Pinhole& k = cameras.cameras[0].intrinsics;
  const float pixel_area = static_cast<float>(1 / (k.fx * k.fy));

  const std::vector<double> sums = CumulativeAreas(tracer.mesh());
  Random random(seed);
  for (int64_t drawn = 0; drawn < kDrawsPerPoint * count && std::ssize(samples) < count; drawn += kBatch) {
    std::vector<SurfacePoint> points;
    for (int64_t i = 0; i < kBatch; ++i) points.push_back(DrawPoint(sums, random));
    const auto sightings = tracer.LookAtPoints(points, eyes, pixel_area);
    for (size_t i = 0; i < points.size() && std::ssize(samples) < count; ++i) {
      if (sightings[i].eye >= 0) samples.push_back({tracer.Position(points[i]), sightings[i].color});
    }
  }
  return samples;
}

}  // namespace anchorsplat
