#include "enhance/gaussian_regions.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "core/statistics.h"

namespace anchorsplat {

namespace {

constexpr int64_t kFew = 8, kMore = 64, kMany = 512;
constexpr double kHarmlessWidth = 0.75, kHarmlessSpacing = 0.3;

}  // namespace

std::array<double, 3> AxesOf(const GaussianCloud& cloud, size_t i) {
  std::array<double, 3> axes;
  for (size_t a = 0; a < 3; ++a) axes[a] = std::exp(double{cloud.log_scales[3 * i + a]});
  std::ranges::sort(axes);
  return axes;
}

double GaussianRegion::HarmlessPixel() const { return std::min(kHarmlessWidth * width, kHarmlessSpacing * wide); }

GaussianRegions::GaussianRegions(const GaussianCloud& cloud, double thinned)
    : tree_(cloud.means), middle_(static_cast<size_t>(cloud.size())), footprint_(middle_.size()), thinned_(thinned) {
  for (size_t i = 0; i < middle_.size(); ++i) {
    const auto [smallest, middle, largest] = AxesOf(cloud, i);
    middle_[i] = static_cast<float>(middle);
    footprint_[i] = static_cast<float>(std::sqrt(largest * middle));
  }
}

// So many others lie within π r² of the surface.
double GaussianRegions::Side(std::span<const KdTree::Neighbour> nearest, int64_t found, int64_t count) const {
  if (found < 2) return 0;
  const int64_t last = std::min(count, found - 1);
  const double squared = nearest[static_cast<size_t>(last)].squared_distance / thinned_;
  return std::sqrt(std::numbers::pi * squared / static_cast<double>(last));
}

GaussianRegion GaussianRegions::Around(const float* place) const {
  // One that lies at the place itself has no part in how far apart they are.
  std::array<KdTree::Neighbour, kMore + 1> nearest;
  const int64_t found = tree_.NearestTo({place[0], place[1], place[2]}, nearest);
  GaussianRegion region;
  if (found < 2) return region;
  region.spacing = Side(nearest, found, kFew);
  region.wide = Side(nearest, found, kMore);
  const auto median = [&](const Buffer<float>& values) {
    std::array<float, kMore + 1> own;
    for (size_t k = 0; k < static_cast<size_t>(found); ++k) own[k] = values[static_cast<size_t>(nearest[k].index)];
    return double{Quantile(std::span(own).first(static_cast<size_t>(found)), 0.5)};
  };
  region.width = median(middle_);
  region.footprint = median(footprint_);
  return region;
}

double GaussianRegions::SpacingOfMany(const float* place) const {
  std::array<KdTree::Neighbour, kMany + 1> nearest;
  const int64_t found = tree_.NearestTo({place[0], place[1], place[2]}, nearest);
  return Side(nearest, found, kMany);
}

}  // namespace anchorsplat
