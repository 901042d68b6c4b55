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

// Positions and colours of a fit's initial Gaussians.
struct InitialPoints {
  Buffer<float> positions;  // [M,3] world, relative to an origin (core/world_origin.h)
  Buffer<float> colors;     // [M,3] rgb 0–1

  int64_t size() const { return static_cast<int64_t>(positions.size() / 3); }
};

// Points of structure from motion, relative to `origin`. Drops positions beyond the range of float.
InitialPoints PointsOf(std::span<const ColmapPoint> points, const WorldOrigin& origin = {});
// The same for world positions with rgb 0–1, [M,3] each.
InitialPoints PointsOf(std::span<const double> positions, std::span<const float> colors, const WorldOrigin& origin);

// `count` points of random colour, uniform within ±`extent` scene scales of the origin, as gsplat's `init_type =
// "random"` (100,000 points, `init_extent` 3). INRIA's trainer uses ±1.3 units for NeRF-synthetic scenes: 0.3 scene
// scales.
inline constexpr int64_t kRandomPoints = 100000;
inline constexpr double kRandomExtent = 3;
InitialPoints RandomPoints(int64_t count, double scene_scale, uint64_t seed, double extent = kRandomExtent);

// `count` points of random colour in the part of such a cube, around the cameras' mean centre, that many cameras see:
// at least half as many as see the best-seen place. A better start than the whole cube, most of which no camera sees.
// Falls back to RandomPoints if no camera sees any of it.
InitialPoints RandomPointsInView(int64_t count, const std::vector<Camera>& cameras, double scene_scale, uint64_t seed);

// Centres and DC colours of a splat's finite rows, relative to `origin`, as a start for another fit.
InitialPoints PointsOf(const GaussianCloud& cloud, const WorldOrigin& origin = {});

// `count` points evenly chosen by index; all if there are fewer or `count` is unset.
InitialPoints SubsampleEvenly(const InitialPoints& points, std::optional<int64_t> count);

}  // namespace anchorsplat
