#pragma once

#include <cstdint>
#include <span>

#include "core/buffer.h"
#include "core/gaussian_cloud.h"
#include "network/normalisation.h"
#include "published/published_config.h"

namespace anchorsplat {

// How a cloud with fewer than 15 higher SH coefficients is padded.
enum class ShPadding {
  kZeros,      // missing coefficients are zero
  kScrambled,  // as the release: appends zeros to the file's channel-major list and reads it as if it were complete, so
               // all 9 values of degree 1 become coefficients of red. Degrees 0 and 3 are unaffected
};

// Input rows [rows,59] of the network for the given rows of a cloud: normalised, columns as in kAttributes.
Buffer<float> FeatureRows(const GaussianCloud& cloud, std::span<const int64_t> rows, const Normalisation& normalisation,
                          ShPadding padding);

}  // namespace anchorsplat
