#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/gaussian_cloud.h"
#include "core/parallel.h"

namespace anchorsplat {

// Sky shells, floaters and giants say nothing about a fit, and time is bounded.
inline constexpr float kShowingOpacity = 0.1f;
inline constexpr double kShowingFarthest = 1.5;  // of the radius that frames the cloud
inline constexpr size_t kMostShowing = 200'000;

// The Gaussians of a cloud that say something about its fit: usable, of kShowingOpacity or more and near the middle of
// the cloud; those nearest to it where there are more than kMostShowing. Ascending rows.
struct ShowingGaussians {
  std::vector<int64_t> all;
  // Without those that are nearly black: fits on black keep black ones around the object that no picture shows. The
  // same as `all` where fewer than kLeastGaussians are not black.
  std::vector<int64_t> bright;
  std::vector<int64_t> not_black;  // of the whole cloud, usable, visible or not
};
ShowingGaussians FindShowingGaussians(const GaussianCloud& cloud);

// What `look(i, out)` puts into `out` for all i below `count`, in their order. Looks at many at a time.
template <typename Item, typename Look>
std::vector<Item> CollectRows(int64_t count, Look&& look) {
  constexpr int64_t kRowsPerTask = 1 << 16;
  std::vector<std::vector<Item>> parts(static_cast<size_t>((count + kRowsPerTask - 1) / kRowsPerTask));
  ParallelFor(0, count, kRowsPerTask, [&](int64_t first, int64_t last) {
    std::vector<Item>& part = parts[static_cast<size_t>(first / kRowsPerTask)];
    for (int64_t i = first; i < last; ++i) look(i, part);
  });
  std::vector<Item> all;
  size_t size = 0;
  for (const auto& part : parts) size += part.size();
  all.reserve(size);
  for (auto& part : parts) {
    all.insert(all.end(), part.begin(), part.end());
    std::vector<Item>().swap(part);
  }
  return all;
}

double SquaredDistance(const float* a, const float* b);  // of two points of three coordinates

}  // namespace anchorsplat
