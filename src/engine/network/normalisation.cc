#include "network/normalisation.h"

#include <algorithm>
#include <cmath>

#include "core/text.h"

namespace anchorsplat {

namespace {

constexpr float kSmallestExtent = 1e-8f;
constexpr double kCenteredRatio = 0.10;

}  // namespace

float Normalisation::LogScale() const { return std::log(scale); }

Result<Normalisation> FitNormalisation(std::span<const float> means, NormalisationMode mode) {
  if (means.empty()) return Error{ErrorCode::kBadArgument, "the splat has no Gaussians"};
  std::array<float, 3> low = {means[0], means[1], means[2]}, high = low;
  for (size_t i = 0; i < means.size(); ++i) {
    low[i % 3] = std::min(low[i % 3], means[i]);
    high[i % 3] = std::max(high[i % 3], means[i]);
  }
  float largest = 0, range = 0, centre = 0;
  for (size_t axis = 0; axis < 3; ++axis) {
    largest = std::max({largest, std::fabs(low[axis]), std::fabs(high[axis])});
    range = std::max(range, high[axis] - low[axis]);
    centre = std::max(centre, std::fabs((low[axis] + high[axis]) / 2));
  }
  if ((mode == NormalisationMode::kAuto || mode == NormalisationMode::kBbox) && !(range >= kSmallestExtent)) {
    return Error{ErrorCode::kBadArgument,
                 "all Gaussians are at one place, so the splat cannot be scaled to the network's cube"};
  }
  if (mode != NormalisationMode::kBbox && !(largest >= kSmallestExtent)) {
    return Error{ErrorCode::kBadArgument,
                 "all Gaussians are at the origin, so the splat cannot be scaled to the network's cube"};
  }
  if (mode == NormalisationMode::kAuto) {
    const float ratio = centre / std::max(largest, kSmallestExtent);
    mode = ratio <= kCenteredRatio ? NormalisationMode::kCentered : NormalisationMode::kBbox;
  }

  Normalisation result;
  result.mode = mode;
  result.shift = {0.5f, 0.5f, 0.5f};
  if (mode == NormalisationMode::kCentered) {
    result.scale = 0.5f / largest;
  } else if (mode == NormalisationMode::kUnit) {
    result.scale = 0.5f;
  } else {
    result.scale = 1.0f / (high[0] - low[0]);
    for (size_t axis = 1; axis < 3; ++axis) result.scale = std::min(result.scale, 1.0f / (high[axis] - low[axis]));
    for (size_t axis = 0; axis < 3; ++axis) {
      result.shift[axis] = 0.5f - (low[axis] * result.scale + high[axis] * result.scale) / 2;
    }
  }
  if (!std::isfinite(result.scale) || !(result.scale > 0)) {
    return Error{ErrorCode::kBadArgument,
                 Cat("the splat's extent (", range, ") cannot be scaled to the network's cube")};
  }
  return result;
}

}  // namespace anchorsplat
