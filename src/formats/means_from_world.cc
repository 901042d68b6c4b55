#include "formats/means_from_world.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/parallel.h"
#include "core/statistics.h"
#include "core/world_origin.h"

namespace anchorsplat {

namespace {

// Half of the Gaussians are longer; of very many, of every so many. `sample` gets where these are.
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

}  // namespace

void MeansFromWorld(const Buffer<double>& world, GaussianCloud& cloud) {
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
}

}  // namespace anchorsplat
