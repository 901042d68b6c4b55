#include "scene/mesh.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/finite.h"
#include "core/text.h"

namespace anchorsplat {

namespace {

using Vec3 = std::array<float, 3>;

Status CheckCount(const char* what, size_t have, size_t vertices) {
  if (have == 0 || have == vertices) return {};
  return Error{ErrorCode::kBadArgument, Cat("mesh has ", vertices, " positions and ", have, " ", what)};
}

// Twice the area, in double: meshes may measure kilometres or micrometres.
double DoubleArea(const Vec3& a, const Vec3& b, const Vec3& c) {
  const double u[3] = {double{b[0]} - a[0], double{b[1]} - a[1], double{b[2]} - a[2]};
  const double v[3] = {double{c[0]} - a[0], double{c[1]} - a[1], double{c[2]} - a[2]};
  const double n[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
  return std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
}

}  // namespace

Status Validate(const Mesh& mesh) {
  const size_t vertices = mesh.positions.size();
  ANCHORSPLAT_RETURN_IF_ERROR(CheckCount("normals", mesh.normals.size(), vertices));
  ANCHORSPLAT_RETURN_IF_ERROR(CheckCount("texture coordinates", mesh.uvs.size(), vertices));
  ANCHORSPLAT_RETURN_IF_ERROR(CheckCount("colours", mesh.colors.size(), vertices));
  if (mesh.triangles.size() != mesh.triangle_materials.size()) {
    return Error{ErrorCode::kBadArgument, Cat("mesh has ", mesh.triangles.size(), " triangles and ",
                                              mesh.triangle_materials.size(), " material indices")};
  }
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const uint32_t v : mesh.triangles[t]) {
      if (v >= vertices)
        return Error{ErrorCode::kBadArgument, Cat("triangle ", t, " uses vertex ", v, " of ", vertices)};
    }
    const int32_t m = mesh.triangle_materials[t];
    if (m < 0 || static_cast<size_t>(m) >= mesh.materials.size()) {
      return Error{ErrorCode::kBadArgument, Cat("triangle ", t, " uses material ", m, " of ", mesh.materials.size())};
    }
  }
  for (const Material& material : mesh.materials) {
    if (material.texture < -1 || material.texture >= static_cast<int>(mesh.textures.size())) {
      return Error{ErrorCode::kBadArgument, Cat("material \"", Printable(material.name), "\" uses texture ",
                                                material.texture, " of ", mesh.textures.size())};
    }
  }
  for (const Texture& texture : mesh.textures) {
    if (texture.width < 1 || texture.height < 1 ||
        texture.rgba.size() != static_cast<size_t>(texture.width) * static_cast<size_t>(texture.height) * 4) {
      return Error{ErrorCode::kBadArgument, Cat("texture \"", Printable(texture.name), "\" of ", texture.width, " x ",
                                                texture.height, " has ", texture.rgba.size(), " bytes")};
    }
  }
  return {};
}

DroppedTriangles DropInvisibleTriangles(Mesh& mesh) {
  DroppedTriangles dropped;
  size_t kept = 0;
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    const Vec3& pa = mesh.positions[a];
    const Vec3& pb = mesh.positions[b];
    const Vec3& pc = mesh.positions[c];
    if (!(mesh.materials[static_cast<size_t>(mesh.triangle_materials[t])].opacity >= kMinVisibleOpacity)) {
      ++dropped.transparent;
    } else if (!AllFinite(pa.data(), 3) || !AllFinite(pb.data(), 3) || !AllFinite(pc.data(), 3)) {
      ++dropped.not_finite;
    } else if (!(DoubleArea(pa, pb, pc) > 0)) {
      ++dropped.degenerate;
    } else {
      mesh.triangles[kept] = mesh.triangles[t];
      mesh.triangle_materials[kept++] = mesh.triangle_materials[t];
    }
  }
  mesh.triangles.resize(kept);
  mesh.triangle_materials.resize(kept);
  return dropped;
}

Result<Mesh> NormalizedToUnitCube(Mesh mesh) {
  if (mesh.triangles.empty()) return Error{ErrorCode::kBadArgument, "mesh has no visible triangle"};
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::array<double, 3> low = {kInfinity, kInfinity, kInfinity};
  std::array<double, 3> high = {-kInfinity, -kInfinity, -kInfinity};
  for (const auto& triangle : mesh.triangles) {
    for (const uint32_t v : triangle) {
      for (size_t k = 0; k < 3; ++k) {
        low[k] = std::min(low[k], double{mesh.positions[v][k]});
        high[k] = std::max(high[k], double{mesh.positions[v][k]});
      }
    }
  }
  const double side = std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]});
  if (!(side > 0) || !std::isfinite(side)) return Error{ErrorCode::kBadArgument, "mesh has no extent"};
  for (auto& p : mesh.positions) {
    for (size_t k = 0; k < 3; ++k) p[k] = static_cast<float>((p[k] - 0.5 * (low[k] + high[k])) / side);
  }
  return mesh;
}

}  // namespace anchorsplat
