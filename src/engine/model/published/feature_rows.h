#pragma once

#include <cstdint>
#include <span>

#include "core/buffer.h"
#include "core/gaussian_cloud.h"
#include "model/published/published_config.h"
#include "model/shared/normalisation.h"

namespace anchorsplat {

// What becomes of a cloud with fewer than 15 higher SH coefficients.
enum class ShPadding {
  kZeros,      // missing coefficients are zero
  kScrambled,  // as the release does it: zeros after the file's channel-major list, which is then read as if it were
               // complete, so that all 9 values of degree 1 become coefficients of red; the same for degrees 0 and 3
};

// The network's input rows [N,59] of a cloud: normalised, in the order of kAttributes. Rows are those of `rows`.
Buffer<float> FeatureRows(const GaussianCloud& cloud, std::span<const int64_t> rows, const Normalisation& normalisation,
                          ShPadding padding);

}  // namespace anchorsplat
