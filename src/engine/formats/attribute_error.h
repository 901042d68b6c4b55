#pragma once

#include <cstdint>
#include <string>

#include "core/buffer.h"
#include "core/cloud_view.h"
#include "core/result.h"

namespace anchorsplat {

// Deviations between the attributes of two clouds, over rows that are usable in both.
struct Deviation {
  double rms = 0;
  double max = 0;
};

struct AttributeError {
  int64_t compared = 0;  // rows
  int64_t left_out = 0;  // rows that are unusable (core/gaussian_cloud.h) in either cloud
  Deviation means;       // distance, world units
  Deviation log_scales;  // per axis; scales below e⁻²⁰ count as e⁻²⁰, indistinguishable from 0
  Deviation rotations;   // angle between them, radians, 0–π
  Deviation opacities;   // 0–1, not logits
  Deviation colors;      // f_dc as colour: 0.2820948·difference, per channel
  Deviation harmonics;   // SH of degree ≥ 1 as stored, per coefficient; missing ones are zero
};

// Compares row i of `a` with row rows[i] of `b` (empty `rows`: row i), in world coordinates. `world_a`, `world_b`
// [N,3]: exact positions, if means are rounded; may be empty. kBadArgument: sizes differ.
Result<AttributeError> CompareAttributes(const CloudView& a, const CloudView& b, const Buffer<uint32_t>& rows = {},
                                         const Buffer<double>& world_b = {}, const Buffer<double>& world_a = {});

// One line per attribute, for users.
std::string FormatAttributeError(const AttributeError& error);

}  // namespace anchorsplat
