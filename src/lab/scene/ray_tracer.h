#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/camera.h"
#include "core/image.h"
#include "core/result.h"
#include "scene/mesh.h"
#include "scene/surface_shader.h"

namespace anchorsplat {

struct TraceOptions {
  int samples = 4;  // rays per pixel and side, on a regular grid: 4 is 16 rays a pixel
};
inline constexpr int kMaxTraceSamples = 16;

// What a picture cost, in seconds of processor time over all threads.
struct TraceCost {
  int64_t rays = 0;
  double ray_seconds = 0;
  double shade_seconds = 0;
  TraceCost& operator+=(const TraceCost& other);
};

// Pictures of a mesh by ray casting with Embree, lit as surface_shader.h says. The same bits for any number of threads
// and on all x86 machines with AVX2: Embree is held to that instruction set, and its tree is built by one thread,
// because which of two coincident surfaces is met first depends on the tree.
class RayTracer {
 public:
  // Errors (kBadArgument): an invalid mesh, no triangles, more than Embree can number; kIo: Embree does not start.
  static Result<RayTracer> Create(Mesh mesh);
  RayTracer(RayTracer&&) noexcept;
  RayTracer& operator=(RayTracer&&) noexcept;
  ~RayTracer();

  const Mesh& mesh() const;

  // The view of `camera`: rgba, 0–1, straight alpha. Alpha is the fraction of the pixel's rays that met the object, rgb
  // the mean of what those saw, so that rgb·a + background·(1−a) is the picture over any background. rgb is 0 where
  // alpha is. Errors (kBadArgument): impossible size, samples out of 1–16.
  Result<Image> Render(const Camera& camera, const TraceOptions& options = {}, TraceCost* cost = nullptr) const;

  // For each point of the surface the first of `eyes`, counted from a start that changes from point to point, from
  // which nothing hides it, and its colour from there; `sample_area` as in SampleFootprint. Eye −1 where all are
  // blocked or the point lies in a hole.
  struct Sighting {
    int eye = -1;
    std::array<float, 3> color = {0, 0, 0};
  };
  std::vector<Sighting> LookAtPoints(std::span<const SurfacePoint> points, std::span<const std::array<double, 3>> eyes,
                                     float sample_area) const;
  std::array<float, 3> Position(const SurfacePoint& point) const;  // world

  // Whether anything stands between two places; what is at the places themselves does not count.
  bool IsBlocked(const std::array<float, 3>& from, const std::array<float, 3>& to) const;

 private:
  struct Scene;
  explicit RayTracer(std::unique_ptr<Scene> scene);
  std::unique_ptr<Scene> scene_;
};

}  // namespace anchorsplat
