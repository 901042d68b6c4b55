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

double MiddleAxis(const GaussianCloud& cloud, size_t i) {
  std::array<float, 3> axes;
  std::copy_n(cloud.log_scales.data() + 3 * i, 3, axes.begin());
  std::ranges::sort(axes);
  return std::exp(double{axes[1]});
}

double GaussianRegion::HarmlessPixel() const { return std::min(kHarmlessWidth * width, kHarmlessSpacing * wide); }

GaussianRegions::GaussianRegions(const GaussianCloud& cloud, double thinned)
    : tree_(cloud.means), middle_(static_cast<size_t>(cloud.size())), thinned_(thinned) {
  for (size_t i = 0; i < middle_.size(); ++i) middle_[i] = static_cast<float>(MiddleAxis(cloud, i));
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
  std::array<float, kMore + 1> middle;
  for (size_t k = 0; k < static_cast<size_t>(found); ++k) middle[k] = middle_[static_cast<size_t>(nearest[k].index)];
  region.width = double{Quantile(std::span(middle).first(static_cast<size_t>(found)), 0.5)};
  return region;
}

double GaussianRegions::SpacingOfMany(const float* place) const {
  std::array<KdTree::Neighbour, kMany + 1> nearest;
  const int64_t found = tree_.NearestTo({place[0], place[1], place[2]}, nearest);
  return Side(nearest, found, kMany);
}

}  // namespace anchorsplat
