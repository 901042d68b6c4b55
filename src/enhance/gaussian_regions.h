#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/buffer.h"
#include "core/gaussian_cloud.h"
#include "core/kd_tree.h"

namespace anchorsplat {

// Lengths of the axes of a Gaussian, the smallest first; world units.
std::array<double, 3> AxesOf(const GaussianCloud& cloud, size_t i);

// What the Gaussians around a place of a splat's surface say, whatever it was trained at. World units.
struct GaussianRegion {
  double spacing = 0;    // side of the square that each of 8 has of the surface
  double wide = 0;       // the same of 64
  double width = 0;      // median of the middle axes of 64
  double footprint = 0;  // median of their √(largest × middle axis)

  // A pixel for which the filter does no harm there. The variance that it gives back at the usual four times closer is
  // 0.2 pixels²: half of the Gaussians of the region become wider by less than a seventeenth, and the thinnest ones
  // hardly wider than their neighbours are. Where these lie closer than a few pixels there is no room for more.
  double HarmlessPixel() const;
};

// Regions of a splat around any place.
class GaussianRegions {
 public:
  // `cloud`: Gaussians that show. `thinned`: how many more there were, of which these are an even sample.
  explicit GaussianRegions(const GaussianCloud& cloud, double thinned = 1);

  int64_t size() const { return tree_.size(); }
  // Of the Gaussians nearest to `place`, fewer than 64 where there are not so many; nothing but zeros where there is
  // none but one.
  GaussianRegion Around(const float* place) const;
  // GaussianRegion::spacing of 512: hardly of the detail that a fit put there, but of the size of its pixels.
  double SpacingOfMany(const float* place) const;

 private:
  double Side(std::span<const KdTree::Neighbour> nearest, int64_t found, int64_t count) const;

  KdTree tree_;
  Buffer<float> middle_, footprint_;  // [size]
  double thinned_;
};

}  // namespace anchorsplat
