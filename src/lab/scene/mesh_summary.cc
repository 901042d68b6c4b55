#include "scene/mesh_summary.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <vector>

#include "core/random.h"

namespace anchorsplat {

namespace {

using Vec3d = std::array<double, 3>;

class SurfacePoints {
 public:
  explicit SurfacePoints(const Mesh& mesh) : mesh_(mesh) {
    double area = 0;
    for (const auto& triangle : mesh.triangles) {
      const Vec3d u = Edge(triangle[0], triangle[1]);
      const Vec3d v = Edge(triangle[0], triangle[2]);
      area += std::hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]);
      area_up_to_.push_back(area);
    }
  }

  Vec3d Draw(Random& random) const {
    const double at = random.Uniform() * area_up_to_.back();
    const auto found = std::upper_bound(area_up_to_.begin(), area_up_to_.end(), at);
    const size_t t = std::min<size_t>(static_cast<size_t>(found - area_up_to_.begin()), area_up_to_.size() - 1);
    double a = random.Uniform(), b = random.Uniform();
    if (a + b > 1) {
      a = 1 - a;
      b = 1 - b;
    }
    const auto& triangle = mesh_.triangles[t];
    const Vec3d u = Edge(triangle[0], triangle[1]);
    const Vec3d v = Edge(triangle[0], triangle[2]);
    Vec3d point;
    for (size_t k = 0; k < 3; ++k) point[k] = mesh_.positions[triangle[0]][k] + a * u[k] + b * v[k];
    return point;
  }

 private:
  Vec3d Edge(uint32_t from, uint32_t to) const {
    const auto& a = mesh_.positions[from];
    const auto& b = mesh_.positions[to];
    return {double{b[0]} - a[0], double{b[1]} - a[1], double{b[2]} - a[2]};
  }

  const Mesh& mesh_;
  std::vector<double> area_up_to_;
};

std::array<float, 32> ShapeDistribution(const Mesh& mesh) {
  constexpr size_t kPairs = 16'384;
  const SurfacePoints points(mesh);
  Random random(1);  // fixed, because summaries are compared with each other
  std::vector<double> distances(kPairs);
  double mean = 0;
  for (double& distance : distances) {
    const Vec3d a = points.Draw(random);
    const Vec3d b = points.Draw(random);
    distance = std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
    mean += distance / kPairs;
  }
  std::array<float, 32> shape{};
  if (!(mean > 0) || !std::isfinite(mean)) return shape;
  for (const double distance : distances) {
    const double bin = distance / (3 * mean) * static_cast<double>(shape.size());
    shape[std::min(static_cast<size_t>(std::max(bin, 0.0)), shape.size() - 1)] += 1.0f / kPairs;
  }
  return shape;
}

uint32_t EightBits(const std::array<float, 3>& color) {
  uint32_t packed = 0;
  for (const float v : color) {
    packed = packed << 8 | static_cast<uint32_t>(std::lround(std::clamp(v, 0.0f, 1.0f) * 255));
  }
  return packed;
}

}  // namespace

MeshSummary Summarize(Mesh mesh) {
  DropInvisibleTriangles(mesh);
  MeshSummary summary;
  summary.triangles = static_cast<int64_t>(mesh.triangles.size());
  if (mesh.triangles.empty()) return summary;
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  summary.low = {kInfinity, kInfinity, kInfinity};
  summary.high = {-kInfinity, -kInfinity, -kInfinity};
  std::vector<bool> vertex_used(mesh.positions.size()), material_used(mesh.materials.size());
  std::set<uint32_t> colors;
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto m = static_cast<size_t>(mesh.triangle_materials[t]);
    material_used[m] = true;
    const Material& material = mesh.materials[m];
    for (const uint32_t v : mesh.triangles[t]) {
      vertex_used[v] = true;
      for (size_t k = 0; k < 3; ++k) {
        summary.low[k] = std::min(summary.low[k], mesh.positions[v][k]);
        summary.high[k] = std::max(summary.high[k], mesh.positions[v][k]);
      }
      if (material.texture >= 0) continue;
      std::array<float, 3> color = material.diffuse;
      if (!mesh.colors.empty()) {
        for (size_t k = 0; k < 3; ++k) color[k] *= mesh.colors[v][k];
      }
      colors.insert(EightBits(color));
    }
  }
  std::set<int> textures;
  for (size_t m = 0; m < mesh.materials.size(); ++m) {
    if (material_used[m] && mesh.materials[m].texture >= 0) textures.insert(mesh.materials[m].texture);
  }
  summary.vertices = std::count(vertex_used.begin(), vertex_used.end(), true);
  summary.materials = std::count(material_used.begin(), material_used.end(), true);
  summary.textures = static_cast<int64_t>(textures.size());
  summary.colors = static_cast<int64_t>(colors.size());
  summary.shape = ShapeDistribution(mesh);
  return summary;
}

}  // namespace anchorsplat
