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
  int samples = 4;  // rays per pixel side, on a regular grid: 4 means 16 rays per pixel
};
inline constexpr int kMaxTraceSamples = 16;

// Cost of rendering: processor seconds over all threads.
struct TraceCost {
  int64_t rays = 0;
  double ray_seconds = 0;
  double shade_seconds = 0;
  TraceCost& operator+=(const TraceCost& other);
};

// Renders a mesh by ray casting with Embree, lit as in surface_shader.h. The same bits for any number of threads and on
// all x86 machines with AVX2: Embree is limited to that instruction set, and one thread builds its tree, which decides
// which of two coincident surfaces is hit first.
class RayTracer {
 public:
  // Errors: kBadArgument: an invalid mesh, no triangles, more than Embree can number; kIo: Embree does not start.
  static Result<RayTracer> Create(Mesh mesh);
  RayTracer(RayTracer&&) noexcept;
  RayTracer& operator=(RayTracer&&) noexcept;
  ~RayTracer();

  const Mesh& mesh() const;

  // Renders `camera`'s view: rgba, 0–1, straight alpha. Alpha is the fraction of a pixel's rays that hit the object,
  // rgb the mean of their colours, so rgb·a + background·(1−a) is the picture over any background. rgb is 0 where alpha
  // is.
  // Errors (kBadArgument): impossible size; samples not in 1–16.
  Result<Image> Render(const Camera& camera, const TraceOptions& options = {}, TraceCost* cost = nullptr) const;

  // For each surface point, the first of `eyes` that sees it and its colour from there. The search starts at an eye
  // that varies from point to point. Eye −1 if all are blocked or the point is in a hole. `sample_area`: see
  // SampleFootprint.
  struct Sighting {
    int eye = -1;
    std::array<float, 3> color = {0, 0, 0};
  };
  std::vector<Sighting> LookAtPoints(std::span<const SurfacePoint> points, std::span<const std::array<double, 3>> eyes,
                                     float sample_area) const;
  std::array<float, 3> Position(const SurfacePoint& point) const;  // world

  // Whether anything lies strictly between two positions.
  bool IsBlocked(const std::array<float, 3>& from, const std::array<float, 3>& to) const;

 private:
  struct Scene;
  explicit RayTracer(std::unique_ptr<Scene> scene);
  std::unique_ptr<Scene> scene_;
};

}  // namespace anchorsplat
