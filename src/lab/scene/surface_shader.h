#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "scene/mesh.h"
#include "scene/texture_pyramid.h"

namespace anchorsplat {

// The light of every view: ambient and two distant lamps that stand still in the world, Lambert, no shadows, no gloss.
// colour = min(1, albedo · (0.45 + 0.45·max(0, n·l₁) + 0.25·max(0, n·l₂))). Views of one object agree with each other,
// as the input of a splat must, and no surface is black. Materials that are lit already are shown as they are.
inline constexpr float kAmbientLight = 0.45f;
struct Lamp {
  std::array<float, 3> towards;  // world, need not have length 1
  float strength;
};
inline constexpr Lamp kLamps[2] = {{{0.5f, 0.9f, 0.6f}, 0.45f}, {{-0.7f, 0.2f, -0.5f}, 0.25f}};
inline constexpr float kAlphaTest = 0.5f;  // texels below are holes

// A place on the mesh: barycentric weights of the triangle's second and third corner.
struct SurfacePoint {
  uint32_t triangle = 0;
  float u = 0;
  float v = 0;
};

// What a surface looks like from a direction. Textures (bilinear, level by footprint) or the material's colour, times
// vertex colours; normals interpolated where the mesh has them, else the triangle's; both turned towards the viewer.
class SurfaceShader {
 public:
  explicit SurfaceShader(const Mesh& mesh);  // a valid mesh (Validate); it must outlive the shader

  // Whether a texture with holes covers the triangle.
  bool HasHoles(uint32_t triangle) const;

  // `direction` points from the eye to the surface, of any length; `footprint` is what SampleFootprint gives for it, or
  // 0 to read the texture at full resolution.
  std::array<float, 3> Color(const SurfacePoint& point, const std::array<float, 3>& direction, float footprint) const;
  std::array<float, 3> Albedo(const SurfacePoint& point) const;  // without light, at the texture's full resolution
  float Alpha(const SurfacePoint& point, const std::array<float, 3>& direction, float footprint) const;

 private:
  struct Triangle {
    float normals[3][3];  // of the corners, any length; the face's where the mesh has none
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

// How much a camera's sample covers. It takes `sample_area` on the plane at depth 1 (1/(fx·fy) for a whole pixel); its
// ray runs along d = (x, y, 1) in camera axes and meets a surface at `depth`. With unit normal n the sample covers
// sample_area · depth² / |n·d| of that surface; the division is the shader's.
inline float SampleFootprint(float sample_area, float depth) { return sample_area * depth * depth; }

}  // namespace anchorsplat
