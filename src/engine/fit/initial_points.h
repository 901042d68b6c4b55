#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "cameras/colmap_model.h"
#include "core/buffer.h"
#include "core/camera.h"
#include "core/gaussian_cloud.h"

namespace anchorsplat {

// Where a fit's first Gaussians stand.
struct InitialPoints {
  Buffer<float> positions;  // [M,3] world, from an origin on (core/world_origin.h)
  Buffer<float> colors;     // [M,3] rgb 0–1

  int64_t size() const { return static_cast<int64_t>(positions.size() / 3); }
};

// Points of structure from motion, seen from `origin`. Positions beyond the range of floats are left out.
InitialPoints PointsOf(std::span<const ColmapPoint> points, const WorldOrigin& origin = {});
// The same of world positions with rgb 0–1, [M,3] each.
InitialPoints PointsOf(std::span<const double> positions, std::span<const float> colors, const WorldOrigin& origin);

// `count` points of random colours, uniform within ±`extent` scene scales of the origin: gsplat's `init_type =
// "random"`, which has 100,000 of them and an `init_extent` of 3. INRIA's trainer has ±1.3 units for NeRF-synthetic
// scenes, which is 0.3 scene scales.
inline constexpr int64_t kRandomPoints = 100000;
inline constexpr double kRandomExtent = 3;
InitialPoints RandomPoints(int64_t count, double scene_scale, uint64_t seed, double extent = kRandomExtent);

// `count` points of random colours, uniform in the part of such a cube, around the cameras' mean centre, that many
// cameras see: at least half as many as see the best-seen place. For views without points around something this is a
// better start than the whole cube, most of which nobody looks at. Falls back to RandomPoints where no camera sees any
// of it.
InitialPoints RandomPointsInView(int64_t count, const std::vector<Camera>& cameras, double scene_scale, uint64_t seed);

// Centres, seen from `origin`, and constant colours of a splat, to begin another fit from; of rows that are finite.
InitialPoints PointsOf(const GaussianCloud& cloud, const WorldOrigin& origin = {});

// `count` of the points, evenly spread over their order; all of them when there are not as many, or nobody says.
InitialPoints Thinned(const InitialPoints& points, std::optional<int64_t> count);

}  // namespace anchorsplat
