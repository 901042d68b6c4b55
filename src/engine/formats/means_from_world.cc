#include "formats/means_from_world.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "core/log.h"
#include "core/parallel.h"
#include "core/statistics.h"
#include "core/text.h"
#include "core/world_origin.h"

namespace anchorsplat {

namespace {

// Median length of Gaussians; very large clouds are subsampled. `sample` receives their positions.
double TypicalLength(const GaussianCloud& cloud, const Buffer<double>& world, std::vector<double>& sample) {
  constexpr int64_t kSamples = 1 << 16;
  const int64_t step = (cloud.size() + kSamples - 1) / kSamples;
  std::vector<float> lengths;
  for (int64_t i = 0; i < cloud.size(); i += step) {
    const float* s = cloud.log_scales.data() + 3 * i;
    const float longest = std::max({s[0], s[1], s[2]});
    if (std::isfinite(longest)) lengths.push_back(longest);
    sample.insert(sample.end(), world.data() + 3 * i, world.data() + 3 * i + 3);
  }
  return lengths.empty() ? 0 : std::exp(double{Quantile(lengths, 0.5)});
}

// Warns if Gaussians are so far apart that no origin makes floats fine enough for all. `said`: the file's own origin.
void WarnOfRounding(const std::string& file, const Buffer<double>& world, const WorldOrigin& said,
                    const GaussianCloud& cloud) {
  constexpr double kSeen = 1.0 / 16;  // relative to a Gaussian's length
  int64_t count = 0;
  double most = 0;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    const std::array<double, 3> at = ToWorld(cloud.means.data() + 3 * i, cloud.origin);
    double off = 0;
    for (size_t k = 0; k < 3; ++k)
      off = std::max(off, std::fabs(at[k] - said[k] - world[3 * static_cast<size_t>(i) + k]));
    const float* s = cloud.log_scales.data() + 3 * i;
    if (!IsUsable(cloud, i) || !(off > kSeen * std::exp(double{std::max({s[0], s[1], s[2]})}))) continue;
    ++count;
    most = std::max(most, off);
  }
  if (count == 0) return;
  LogWarning(
      Cat(file, ": positions of ", WithThousands(count), " of ", WithThousands(cloud.size()),
          " Gaussians are rounded, by up to ", most,
          ": they lie too far from the others for 32-bit floats. Split the file into parts that lie close together"));
}

}  // namespace

void MeansFromWorld(const std::string& file, const Buffer<double>& world, GaussianCloud& cloud) {
  const WorldOrigin said = cloud.origin;
  std::vector<double> sample;
  const double length = TypicalLength(cloud, world, sample);
  const WorldOrigin origin = ChooseOrigin(sample, length);
  for (size_t k = 0; k < 3; ++k) cloud.origin[k] += origin[k];
  ParallelFor(0, cloud.size(), 1 << 14, [&](int64_t first, int64_t last) {
    for (int64_t i = 3 * first; i < 3 * last; ++i) {
      const auto at = static_cast<size_t>(i);
      cloud.means[at] = static_cast<float>(world[at] - origin[at % 3]);
    }
  });
  WarnOfRounding(file, world, said, cloud);
}

}  // namespace anchorsplat
