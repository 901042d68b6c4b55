#include "scene/tile_coverage.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace anchorsplat {

namespace {

struct Projected {
  double x = 0;
  double y = 0;
  double depth = 0;
};

}  // namespace

TileCoverage::TileCoverage(const Mesh& mesh, const Camera& camera, int tile_size) {
  const Pinhole& k = camera.intrinsics;
  columns_ = (k.width + tile_size - 1) / tile_size;
  rows_ = (k.height + tile_size - 1) / tile_size;
  marks_.assign(static_cast<size_t>(columns_) * static_cast<size_t>(rows_), 0);

  std::vector<Projected> vertices(mesh.positions.size());
  for (size_t i = 0; i < vertices.size(); ++i) {
    const auto& p = mesh.positions[i];
    const auto c = camera.ToCamera({p[0], p[1], p[2]});
    vertices[i] = {k.fx * c[0] / c[2] + k.cx, k.fy * c[1] / c[2] + k.cy, c[2]};
  }

  constexpr double kMargin = 0.0625;  // pixels; rays are computed in single precision
  constexpr double kNear = 1e-4;      // below this depth a projection is unreliable
  for (const auto& triangle : mesh.triangles) {
    double low[2] = {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
    double high[2] = {-low[0], -low[1]};
    int behind = 0;
    bool unclear = false;
    for (const uint32_t v : triangle) {
      const Projected& p = vertices[v];
      behind += p.depth <= 0 ? 1 : 0;
      unclear |= !(p.depth > kNear) || !std::isfinite(p.x) || !std::isfinite(p.y);
      low[0] = std::min(low[0], p.x);
      low[1] = std::min(low[1], p.y);
      high[0] = std::max(high[0], p.x);
      high[1] = std::max(high[1], p.y);
    }
    if (behind == 3) continue;
    if (unclear) {
      std::fill(marks_.begin(), marks_.end(), uint8_t{1});
      return;
    }
    if (high[0] + kMargin < 0 || high[1] + kMargin < 0 || low[0] - kMargin > k.width || low[1] - kMargin > k.height) {
      continue;
    }
    const auto tile = [&](double pixel, int count) {
      return static_cast<int>(std::clamp(std::floor(pixel / tile_size), 0.0, static_cast<double>(count - 1)));
    };
    const int x0 = tile(low[0] - kMargin, columns_), x1 = tile(high[0] + kMargin, columns_);
    const int y0 = tile(low[1] - kMargin, rows_), y1 = tile(high[1] + kMargin, rows_);
    for (int y = y0; y <= y1; ++y) {
      std::memset(&marks_[static_cast<size_t>(y) * static_cast<size_t>(columns_) + static_cast<size_t>(x0)], 1,
                  static_cast<size_t>(x1 - x0 + 1));
    }
  }
}

}  // namespace anchorsplat
