#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "scene/mesh.h"
#include "scene/texture_pyramid.h"

namespace anchorsplat {

// Lighting of every view: ambient and two distant lamps fixed in the world, Lambertian, without shadows or gloss.
// colour = min(1, albedo · (0.45 + 0.45·max(0, n·l₁) + 0.25·max(0, n·l₂))). So views of an object agree, as splats
// require, and no surface is black. Materials that are already `lit` are shown as they are.
inline constexpr float kAmbientLight = 0.45f;
struct Lamp {
  std::array<float, 3> towards;  // world, any length
  float strength;
};
inline constexpr Lamp kLamps[2] = {{{0.5f, 0.9f, 0.6f}, 0.45f}, {{-0.7f, 0.2f, -0.5f}, 0.25f}};
inline constexpr float kAlphaTest = 0.5f;  // texels with lower alpha are holes

// A point on the mesh: barycentric weights of the triangle's second and third corner.
struct SurfacePoint {
  uint32_t triangle = 0;
  float u = 0;
  float v = 0;
};

// Appearance of a surface from a direction: texture (bilinear, level by footprint) or material colour, times vertex
// colours. Normals are interpolated if the mesh has them, else the triangle's; they face the viewer.
class SurfaceShader {
 public:
  explicit SurfaceShader(const Mesh& mesh);  // valid (Validate); must outlive the shader

  // Whether the triangle's texture has holes.
  bool HasHoles(uint32_t triangle) const;

  // `direction`: from the eye to the surface, any length. `footprint`: from SampleFootprint, or 0 for full texture
  // resolution.
  std::array<float, 3> Color(const SurfacePoint& point, const std::array<float, 3>& direction, float footprint) const;
  std::array<float, 3> Albedo(const SurfacePoint& point) const;  // unlit, at full texture resolution
  float Alpha(const SurfacePoint& point, const std::array<float, 3>& direction, float footprint) const;

 private:
  struct Triangle {
    float normals[3][3];  // of the corners, any length; the face normal if the mesh has none
    float uvs[3][2];
    float face[3];        // unit
    float texel_density;  // texels of level 0 per world unit²; 0: no texture
    int32_t material;
  };
  struct Surface {
    std::array<float, 3> diffuse;
    int texture;
    bool lit;
  };
  float TexelsUnder(const Triangle& triangle, const std::array<float, 3>& direction, float footprint) const;
  std::array<float, 3> AlbedoAt(const Triangle& triangle, const SurfacePoint& point, int level) const;

  const Mesh& mesh_;
  std::vector<Triangle> triangles_;
  std::vector<Surface> materials_;
  std::vector<TexturePyramid> pyramids_;
  std::array<std::array<float, 3>, 2> lamps_;  // unit
};

// Footprint of a camera sample that covers `sample_area` on the plane at depth 1 (1/(fx·fy) for a whole pixel) and
// whose ray, along d = (x, y, 1) in camera axes, hits a surface at `depth`. With unit normal n it covers sample_area ·
// depth² / |n·d| of the surface; the shader divides.
inline float SampleFootprint(float sample_area, float depth) { return sample_area * depth * depth; }

}  // namespace anchorsplat
