#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/random.h"
#include "render/rasterizer_reference.h"

// Compares gradients with difference quotients of the double-precision reference.
namespace anchorsplat::test {

// L = Σ weight·output. Pixels with an α or T near a cut-off have weight 0, as difference quotients across one are
// wrong.
struct LinearLoss {
  RenderGradient weights;

  double operator()(const std::vector<reference::Splat>& splats, const RenderOptions& options) const {
    double loss = 0;
    const Image& color = weights.color;
    for (int y = 0; y < color.height; ++y) {
      for (int x = 0; x < color.width; ++x) {
        if (color.at(0, y, x) == 0) continue;
        const reference::Pixel pixel = reference::Blend(splats, x, y, options);
        for (int c = 0; c < 3; ++c) loss += color.at(c, y, x) * pixel.rgb[static_cast<size_t>(c)];
        if (!weights.alpha.pixels.empty()) loss += weights.alpha.at(0, y, x) * pixel.alpha;
      }
    }
    return loss;
  }
};

inline LinearLoss RandomLoss(uint64_t seed, const GaussianCloud& cloud, const Camera& camera,
                             const RenderOptions& options, bool with_alpha = true) {
  const int width = camera.intrinsics.width, height = camera.intrinsics.height;
  LinearLoss loss;
  loss.weights.color = Image(width, height, 3);
  if (with_alpha) loss.weights.alpha = Image(width, height, 1);
  loss.weights.box = {0, 0, width, height};
  Random random(seed);
  const auto splats = reference::ProjectAll(cloud, camera, options);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double use = reference::Blend(splats, x, y, options).margin > 0.02 ? 1 : 0;
      for (int c = 0; c < 3; ++c) loss.weights.color.at(c, y, x) = static_cast<float>(use * random.Normal());
      if (with_alpha) loss.weights.alpha.at(0, y, x) = static_cast<float>(use * random.Normal());
    }
  }
  return loss;
}

// Whether L is smooth between the two: the same Gaussians in the same order on the same tiles, and no colour clamped in
// only one of them.
inline bool SamePiece(const std::vector<reference::Splat>& a, const std::vector<reference::Splat>& b) {
  const auto same = [](const reference::Splat& s, const reference::Splat& t) {
    bool clamps = true;
    for (size_t c = 0; c < 3; ++c) clamps = clamps && (s.rgb[c] > 0) == (t.rgb[c] > 0);
    return clamps && s.row == t.row && s.tile_x0 == t.tile_x0 && s.tile_x1 == t.tile_x1 && s.tile_y0 == t.tile_y0 &&
           s.tile_y1 == t.tile_y1;
  };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), same);
}

inline CloudGradient Gradient(const GaussianCloud& cloud, const Camera& camera, RenderOptions options,
                              const RenderGradient& weights) {
  options.gradient = true;
  Rasterizer rasterizer;
  RenderOutput output;
  CloudGradient gradient;
  const Status rendered = rasterizer.Render(cloud, camera, options, output);
  EXPECT_TRUE(rendered.ok()) << rendered.error().message;
  const Status status = rasterizer.Backward(cloud, weights, gradient);
  EXPECT_TRUE(status.ok()) << status.error().message;
  return gradient;
}

struct GradientCheck {
  double relative = 2e-3;  // allowed error relative to the value
  double absolute = 1e-4;  // and relative to the array's largest
  int64_t stride = 1;      // checks every stride-th value of an array
};

// Checks all stored values and the background.
inline void ExpectGradientMatches(const GaussianCloud& cloud, const Camera& camera, const RenderOptions& options,
                                  const LinearLoss& loss, const GradientCheck& check = {}) {
  const CloudGradient gradient = Gradient(cloud, camera, options, loss.weights);
  int64_t compared = 0, left_out = 0;
  GaussianCloud moved = cloud;
  const auto compare = [&](const char* name, Buffer<float>& values, const Buffer<float>& analytic, double step) {
    ASSERT_EQ(analytic.size(), values.size()) << name;
    float largest = 0;
    for (const float g : analytic) largest = std::max(largest, std::abs(g));
    EXPECT_TRUE(std::isfinite(largest)) << name;
    for (size_t i = 0; i < values.size(); i += static_cast<size_t>(check.stride)) {
      const float value = values[i];
      if (!std::isfinite(value)) {  // log-scale −Inf: cannot be moved
        EXPECT_EQ(analytic[i], 0.0f) << name << " " << i;
        continue;
      }
      const float up = static_cast<float>(value + step), down = static_cast<float>(value - step);
      values[i] = up;
      const auto above = reference::ProjectAll(moved, camera, options);
      values[i] = down;
      const auto below = reference::ProjectAll(moved, camera, options);
      values[i] = value;
      if (!SamePiece(above, below)) {
        ++left_out;
        continue;
      }
      ++compared;
      const double slope = (loss(above, options) - loss(below, options)) / (double{up} - double{down});
      EXPECT_NEAR(analytic[i], slope, check.relative * std::abs(slope) + check.absolute * largest + 5e-7)
          << name << " " << i << ", largest " << largest;
    }
  };
  compare("means", moved.means, gradient.means, 1e-4);
  compare("log_scales", moved.log_scales, gradient.log_scales, 5e-4);
  compare("quats", moved.quats, gradient.quats, 5e-4);
  compare("opacity_logits", moved.opacity_logits, gradient.opacity_logits, 1e-3);
  compare("sh", moved.sh, gradient.sh, 1e-3);
  EXPECT_LE(left_out, compared / 10);

  const auto splats = reference::ProjectAll(cloud, camera, options);
  for (size_t c = 0; c < 3; ++c) {
    RenderOptions brighter = options;
    brighter.background[c] += 1;
    const double slope = loss(splats, brighter) - loss(splats, options);  // linear
    EXPECT_NEAR(gradient.background[c], slope, 1e-4 * std::abs(slope) + 1e-4) << "background " << c;
  }
}

}  // namespace anchorsplat::test
