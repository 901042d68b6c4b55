#include "scene/smooth_normals.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/vector3.h"

namespace anchorsplat {

namespace {

using Vec3 = std::array<float, 3>;
using Vec3d = std::array<double, 3>;

constexpr size_t kMostMeeting = 512;

Vec3d Minus(const Vec3& a, const Vec3& b) { return {double{a[0]} - b[0], double{a[1]} - b[1], double{a[2]} - b[2]}; }
double Length(const Vec3d& a) { return std::sqrt(Dot(a, a)); }

Vec3d UnitOrZero(const Vec3d& a) {
  const double length = Length(a);
  if (!(length > 0) || !std::isfinite(length)) return {0, 0, 0};
  return {a[0] / length, a[1] / length, a[2] / length};
}

}  // namespace

void FillSmoothNormals(std::span<const Vec3> corners, float angle_degrees, std::vector<Vec3>& normals) {
  const size_t count = corners.size();
  std::vector<uint32_t> missing;  // corners without normal
  for (size_t i = 0; i < count; ++i) {
    const Vec3& n = normals[i];
    if (n[0] == 0 && n[1] == 0 && n[2] == 0) missing.push_back(static_cast<uint32_t>(i));
  }
  if (missing.empty()) return;

  std::vector<Vec3d> facets(count / 3);
  std::vector<float> angles(count);
  for (size_t t = 0; t < facets.size(); ++t) {
    const Vec3* p = &corners[3 * t];
    facets[t] = UnitOrZero(Cross(Minus(p[1], p[0]), Minus(p[2], p[0])));
    for (size_t k = 0; k < 3; ++k) {
      const Vec3d u = UnitOrZero(Minus(p[(k + 1) % 3], p[k]));
      const Vec3d v = UnitOrZero(Minus(p[(k + 2) % 3], p[k]));
      angles[3 * t + k] = static_cast<float>(std::acos(std::clamp(Dot(u, v), -1.0, 1.0)));
    }
  }

  // Sorting groups equal positions; ties by index give sums the same order everywhere.
  std::sort(missing.begin(), missing.end(),
            [&](uint32_t a, uint32_t b) { return corners[a] != corners[b] ? corners[a] < corners[b] : a < b; });
  // Slightly wider, so that faces at exactly the angle are joined despite rounding.
  const double least = std::cos(double{angle_degrees} * std::acos(-1.0) / 180) - 1e-6;
  for (size_t begin = 0; begin < missing.size();) {
    size_t end = begin + 1;
    while (end < missing.size() && corners[missing[end]] == corners[missing[begin]]) ++end;
    for (size_t i = begin; i < end; ++i) {
      const Vec3d& own = facets[missing[i] / 3];
      Vec3d sum = {0, 0, 0};
      if (end - begin <= kMostMeeting) {
        for (size_t j = begin; j < end; ++j) {
          const Vec3d& other = facets[missing[j] / 3];
          if (Dot(own, other) < least) continue;
          for (size_t k = 0; k < 3; ++k) sum[k] += double{angles[missing[j]]} * other[k];
        }
      }
      const Vec3d unit = UnitOrZero(sum);
      const Vec3d& n = Dot(unit, unit) > 0 ? unit : own;
      normals[missing[i]] = {static_cast<float>(n[0]), static_cast<float>(n[1]), static_cast<float>(n[2])};
    }
    begin = end;
  }
}

}  // namespace anchorsplat
