#include "fit/initial_cloud.h"

#include <algorithm>
#include <cmath>

#include "core/finite.h"
#include "core/spherical_harmonics.h"
#include "core/text.h"
#include "fit/nearest_neighbours.h"
#include "fit/random_streams.h"

namespace anchorsplat {

namespace {

constexpr double kSmallestScale = 1e-4;  // scene scales

Error Bad(const std::string& sentence) { return {ErrorCode::kBadArgument, "initial points: " + sentence}; }

}  // namespace

Result<GaussianCloud> InitialCloud(const InitialPoints& points, double scene_scale,
                                   const InitialCloudOptions& options) {
  if (points.size() == 0) return Bad("there are none");
  if (points.positions.size() != points.colors.size() || points.positions.size() % 3 != 0) {
    return Bad("positions and colours differ in number");
  }
  if (!AllFinite(points.positions)) return Bad("a position is not finite");
  if (options.sh_degree < 0 || options.sh_degree > kMaxShDegree) return Bad("SH degree must be 0 to 3");
  if (!(options.opacity > 0 && options.opacity < 1)) return Bad("opacity must lie between 0 and 1");
  if (!(options.scale > 0)) return Bad("scale must be positive");

  const Buffer<float> distances = MeanSquaredNeighbourDistance(points.positions);
  const double smallest = kSmallestScale * scene_scale;
  GaussianCloud cloud;
  cloud.Resize(points.size(), options.sh_degree);
  std::copy(points.positions.begin(), points.positions.end(), cloud.means.begin());
  std::fill(cloud.opacity_logits.begin(), cloud.opacity_logits.end(),
            static_cast<float>(std::log(options.opacity / (1 - options.opacity))));
  std::fill(cloud.sh.begin(), cloud.sh.end(), 0.0f);
  Random random = RandomStream(options.seed, RandomPurpose::kInitialQuats);
  const auto stride = static_cast<size_t>(cloud.sh_stride());
  for (size_t i = 0; i < static_cast<size_t>(points.size()); ++i) {
    const double scale = std::max(smallest, options.scale * std::sqrt(double{distances[i]}));
    std::fill_n(cloud.log_scales.begin() + static_cast<ptrdiff_t>(3 * i), 3, static_cast<float>(std::log(scale)));
    for (size_t a = 0; a < 4; ++a) cloud.quats[4 * i + a] = static_cast<float>(random.Uniform());
    for (size_t c = 0; c < 3; ++c) cloud.sh[stride * i + c] = (points.colors[3 * i + c] - 0.5f) / kSh0;
  }
  return cloud;
}

}  // namespace anchorsplat
