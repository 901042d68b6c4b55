#include "scene/surface_shader.h"

#include <algorithm>
#include <cmath>

#include "core/finite.h"
#include "core/vector3.h"

namespace anchorsplat {

namespace {

using Vec3 = std::array<float, 3>;

// Unit vector, or `fallback` for a zero vector.
Vec3 Normalized(const Vec3& a, const Vec3& fallback) {
  const float square = Dot(a.data(), a.data());
  if (!(square > 0) || !std::isfinite(square)) return fallback;
  const float scale = 1 / std::sqrt(square);
  return {a[0] * scale, a[1] * scale, a[2] * scale};
}

// Twice the area times the unit normal, in double: triangles may be tiny.
std::array<double, 3> CrossOfEdges(const Vec3& a, const Vec3& b, const Vec3& c) {
  const std::array<double, 3> e = {double{b[0]} - a[0], double{b[1]} - a[1], double{b[2]} - a[2]};
  const std::array<double, 3> f = {double{c[0]} - a[0], double{c[1]} - a[1], double{c[2]} - a[2]};
  return Cross(e, f);
}

}  // namespace

SurfaceShader::SurfaceShader(const Mesh& mesh) : mesh_(mesh) {
  for (size_t k = 0; k < 2; ++k) lamps_[k] = Normalized(kLamps[k].towards, {0, 1, 0});
  pyramids_.reserve(mesh.textures.size());
  for (const Texture& texture : mesh.textures) pyramids_.emplace_back(texture);
  const Material plain;
  for (const Material& material : mesh.materials) {
    Surface surface{{}, mesh.uvs.empty() ? -1 : material.texture, material.lit};
    for (size_t c = 0; c < 3; ++c) surface.diffuse[c] = UnitOr(material.diffuse[c], plain.diffuse[c]);
    materials_.push_back(surface);
  }

  triangles_.resize(mesh.triangles.size());
  for (size_t t = 0; t < triangles_.size(); ++t) {
    Triangle& out = triangles_[t];
    const auto& corners = mesh.triangles[t];
    out.material = mesh.triangle_materials[t];
    const auto cross = CrossOfEdges(mesh.positions[corners[0]], mesh.positions[corners[1]], mesh.positions[corners[2]]);
    const double twice_area = std::sqrt(cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]);
    Vec3 face = {0, 1, 0};  // for a triangle without area, which no ray hits
    if (twice_area > 0 && std::isfinite(twice_area)) {
      for (size_t k = 0; k < 3; ++k) face[k] = static_cast<float>(cross[k] / twice_area);
    }
    std::copy(face.begin(), face.end(), out.face);
    for (size_t k = 0; k < 3; ++k) {
      const Vec3 normal = mesh.normals.empty() ? face : Normalized(mesh.normals[corners[k]], face);
      std::copy(normal.begin(), normal.end(), out.normals[k]);
      for (size_t i = 0; i < 2; ++i) {
        const float x = mesh.uvs.empty() ? 0.0f : mesh.uvs[corners[k]][i];
        out.uvs[k][i] = std::isfinite(x) ? x : 0.0f;
      }
    }
    out.texel_density = 0;
    const int texture = materials_[static_cast<size_t>(out.material)].texture;
    if (texture >= 0 && twice_area > 0) {
      const TexturePyramid& pyramid = pyramids_[static_cast<size_t>(texture)];
      const double e[2] = {double{out.uvs[1][0]} - out.uvs[0][0], double{out.uvs[1][1]} - out.uvs[0][1]};
      const double f[2] = {double{out.uvs[2][0]} - out.uvs[0][0], double{out.uvs[2][1]} - out.uvs[0][1]};
      const double texels = std::abs(e[0] * f[1] - e[1] * f[0]) * pyramid.width() * pyramid.height();
      out.texel_density = static_cast<float>(std::min(texels / twice_area, 1e30));
    }
  }
}

bool SurfaceShader::HasHoles(uint32_t triangle) const {
  const int texture = materials_[static_cast<size_t>(triangles_[triangle].material)].texture;
  return texture >= 0 && mesh_.textures[static_cast<size_t>(texture)].has_alpha;
}

float SurfaceShader::TexelsUnder(const Triangle& triangle, const Vec3& direction, float footprint) const {
  // Edge-on, the footprint is unbounded; the level is then clamped to the coarsest.
  const float cosine = std::max(std::abs(Dot(triangle.face, direction.data())), 1e-12f);
  return triangle.texel_density * footprint / cosine;
}

Vec3 SurfaceShader::AlbedoAt(const Triangle& triangle, const SurfacePoint& point, int level) const {
  const float w = 1 - point.u - point.v;
  const Surface& surface = materials_[static_cast<size_t>(triangle.material)];
  Vec3 albedo = surface.diffuse;
  if (surface.texture >= 0) {
    const float s = w * triangle.uvs[0][0] + point.u * triangle.uvs[1][0] + point.v * triangle.uvs[2][0];
    const float t = w * triangle.uvs[0][1] + point.u * triangle.uvs[1][1] + point.v * triangle.uvs[2][1];
    const auto texel = pyramids_[static_cast<size_t>(surface.texture)].Sample(s, t, level);
    albedo = {texel[0], texel[1], texel[2]};
  }
  if (!mesh_.colors.empty()) {
    const auto& [a, b, c] = mesh_.triangles[point.triangle];
    for (size_t k = 0; k < 3; ++k) {
      albedo[k] *= UnitOr(w * mesh_.colors[a][k] + point.u * mesh_.colors[b][k] + point.v * mesh_.colors[c][k], 1);
    }
  }
  return albedo;
}

Vec3 SurfaceShader::Albedo(const SurfacePoint& point) const { return AlbedoAt(triangles_[point.triangle], point, 0); }

float SurfaceShader::Alpha(const SurfacePoint& point, const Vec3& direction, float footprint) const {
  const Triangle& triangle = triangles_[point.triangle];
  const Surface& surface = materials_[static_cast<size_t>(triangle.material)];
  if (surface.texture < 0) return 1;
  const float w = 1 - point.u - point.v;
  const float s = w * triangle.uvs[0][0] + point.u * triangle.uvs[1][0] + point.v * triangle.uvs[2][0];
  const float t = w * triangle.uvs[0][1] + point.u * triangle.uvs[1][1] + point.v * triangle.uvs[2][1];
  const int level = LevelOfFootprint(TexelsUnder(triangle, direction, footprint));
  return pyramids_[static_cast<size_t>(surface.texture)].SampleAlpha(s, t, level);
}

Vec3 SurfaceShader::Color(const SurfacePoint& point, const Vec3& direction, float footprint) const {
  const Triangle& triangle = triangles_[point.triangle];
  const int level = triangle.texel_density > 0 ? LevelOfFootprint(TexelsUnder(triangle, direction, footprint)) : 0;
  Vec3 color = AlbedoAt(triangle, point, level);
  if (materials_[static_cast<size_t>(triangle.material)].lit) return color;

  const float w = 1 - point.u - point.v;
  const auto& n = triangle.normals;
  Vec3 face;
  const float away = Dot(triangle.face, direction.data()) > 0 ? -1.0f : 1.0f;
  for (size_t k = 0; k < 3; ++k) face[k] = away * triangle.face[k];
  Vec3 normal;
  for (size_t k = 0; k < 3; ++k) normal[k] = w * n[0][k] + point.u * n[1][k] + point.v * n[2][k];
  normal = Normalized(normal, face);
  const float side = Dot(normal.data(), face.data()) < 0 ? -1.0f : 1.0f;
  float light = kAmbientLight;
  for (size_t k = 0; k < 2; ++k) {
    light += kLamps[k].strength * std::max(0.0f, side * Dot(normal.data(), lamps_[k].data()));
  }
  for (float& x : color) x = std::min(1.0f, x * light);
  return color;
}

}  // namespace anchorsplat
