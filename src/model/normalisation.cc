#include "model/normalisation.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "core/text.h"

namespace anchorsplat {

namespace {

constexpr float kSmallestExtent = 1e-8f;
constexpr double kCenteredRatio = 0.10;

// Flat index of `f_rest` in the file's order (all of red, then green, then blue) and back to [coefficient, rgb].
float RestValue(const float* sh, int rest_coefficients, int64_t coefficient, int64_t rgb, ShPadding padding) {
  if (padding == ShPadding::kScrambled && rest_coefficients > 0) {
    const int64_t flat = rgb * 15 + coefficient;
    if (flat >= int64_t{3} * rest_coefficients) return 0;
    rgb = flat / rest_coefficients;
    coefficient = flat % rest_coefficients;
  }
  return coefficient < rest_coefficients ? sh[(coefficient + 1) * 3 + rgb] : 0;
}

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
                 "all Gaussians are at one place: there is no extent to bring into the network's cube"};
  }
  if (mode != NormalisationMode::kBbox && !(largest >= kSmallestExtent)) {
    return Error{ErrorCode::kBadArgument,
                 "all Gaussians are at the origin: there is no extent to bring into the network's cube"};
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
                 Cat("the splat's extent (", range, ") cannot be brought into the network's cube")};
  }
  return result;
}

Buffer<float> FeatureRows(const GaussianCloud& cloud, std::span<const int64_t> rows, const Normalisation& normalisation,
                          ShPadding padding) {
  Buffer<float> features(rows.size() * static_cast<size_t>(kFeatures));
  const float log_scale = normalisation.LogScale();
  const int rest = cloud.coefficients() - 1;
  ParallelFor(0, static_cast<int64_t>(rows.size()), 1024, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      const int64_t row = rows[static_cast<size_t>(i)];
      float* out = features.data() + i * kFeatures;
      for (size_t axis = 0; axis < 3; ++axis)
        *out++ = normalisation.Apply(cloud.means.data()[3 * row + static_cast<int64_t>(axis)], axis);
      for (int64_t axis = 0; axis < 3; ++axis) *out++ = cloud.log_scales.data()[3 * row + axis] + log_scale;
      *out++ = cloud.opacity_logits.data()[row];
      for (int64_t c = 0; c < 4; ++c) *out++ = cloud.quats.data()[4 * row + c];
      const float* sh = cloud.sh.data() + row * cloud.sh_stride();
      for (int64_t rgb = 0; rgb < 3; ++rgb) *out++ = sh[rgb];
      for (int64_t c = 0; c < 15; ++c) {
        for (int64_t rgb = 0; rgb < 3; ++rgb) *out++ = RestValue(sh, rest, c, rgb, padding);
      }
    }
  });
  return features;
}

}  // namespace anchorsplat
