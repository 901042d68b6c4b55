#include "published/feature_rows.h"

#include "core/parallel.h"

namespace anchorsplat {

namespace {

// With kScrambled, maps through the file's flat f_rest order (all of red, then green, then blue) as the release does.
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
