#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"

namespace anchorsplat {

// Which Gaussians of a splat are visible in which views: those whose blending weights α·T sum to more than kSeenPixels
// over the picture. Half of an object is hidden in any view, which says nothing about it.
inline constexpr double kSeenPixels = 0.05;

class SeenGaussians {
 public:
  // Renders the listed `views` of `cameras` in the splat's own mode; low resolution suffices. Errors: those of
  // Rasterizer::Render and Backward.
  static Result<SeenGaussians> Look(const GaussianCloud& cloud, std::span<const Camera> cameras,
                                    std::span<const size_t> views);

  int64_t size() const { return count_; }
  // Whether Gaussian `row` is visible in `view`, one of those listed.
  bool In(size_t view, int64_t row) const { return seen_[view][static_cast<size_t>(row)]; }

 private:
  int64_t count_ = 0;                    // N
  std::vector<std::vector<bool>> seen_;  // by view: [N], or empty
};

}  // namespace anchorsplat
