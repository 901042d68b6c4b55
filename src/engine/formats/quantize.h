#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "core/activations.h"
#include "core/gaussian_cloud.h"

namespace anchorsplat {

// Quantization to the few bits of splat formats. NaN becomes 0 and values are clamped, so that integer conversion is
// never undefined.

// `unit` in 0–1 to the nearest of 0 … max (≤ 2²⁴).
inline uint32_t QuantizeUnit(float unit, uint32_t max) {
  const float scaled = unit * static_cast<float>(max) + 0.5f;
  if (!(scaled > 0)) return 0;
  return scaled >= static_cast<float>(max) ? max : static_cast<uint32_t>(scaled);
}

// To the nearest byte.
inline uint8_t QuantizeByte(float value) {
  const float shifted = value + 0.5f;
  const float bounded = shifted > 0 ? (shifted < 255.5f ? shifted : 255.5f) : 0.0f;
  return static_cast<uint8_t>(static_cast<int32_t>(bounded));
}

// Opacity byte of a stored logit. Opacities too faint to be drawn become 0: rounded up to 1/255, a large Gaussian would
// cover everything.
inline uint8_t OpacityByte(float logit) {
  const float opacity = Sigmoid(logit);
  return opacity >= kMinOpacity ? QuantizeByte(255 * opacity) : 0;
}

// Rescales a quaternion so that its squared norm fits a float; zero if it has no direction (zero, NaN).
inline std::array<float, 4> RescaledToFloat(const float quat[4]) {
  std::array<float, 4> out = {quat[0], quat[1], quat[2], quat[3]};
  const float square = out[0] * out[0] + out[1] * out[1] + out[2] * out[2] + out[3] * out[3];
  if (square > 1e-30f && square < 1e30f) return out;
  float largest = 0;
  for (const float x : out) largest = std::max(largest, std::fabs(x));
  for (float& x : out) x = static_cast<float>(double{x} / double{largest});
  const bool has_direction = std::isfinite(out[0] + out[1] + out[2] + out[3]);
  return has_direction ? out : std::array<float, 4>{};
}

// A unit quaternion without its largest component, which is implied: the sign is chosen so that it is positive. `rest`
// has the other components in order, each within ±√½. A quaternion without direction (zero, NaN) becomes the identity,
// with `identity` the index of w.
struct SmallestThree {
  uint32_t largest = 0;
  float rest[3] = {0, 0, 0};
};
inline constexpr float kSqrtHalf = 0.70710678118654752f;

inline SmallestThree DropLargest(const float stored[4], uint32_t identity) {
  SmallestThree out;
  const std::array<float, 4> quat = RescaledToFloat(stored);
  const float norm = std::sqrt(quat[0] * quat[0] + quat[1] * quat[1] + quat[2] * quat[2] + quat[3] * quat[3]);
  if (!(norm > 0)) {
    out.largest = identity;
    return out;
  }
  for (uint32_t k = 1; k < 4; ++k) {
    if (std::fabs(quat[k]) > std::fabs(quat[out.largest])) out.largest = k;
  }
  const float factor = (quat[out.largest] < 0 ? -1.0f : 1.0f) / norm;
  int to = 0;
  for (uint32_t k = 0; k < 4; ++k) {
    if (k != out.largest) out.rest[to++] = quat[k] * factor;
  }
  return out;
}

inline void RestoreLargest(const SmallestThree& packed, float quat[4]) {
  float squares = 0;
  int from = 0;
  for (uint32_t k = 0; k < 4; ++k) {
    if (k == packed.largest) continue;
    quat[k] = packed.rest[from++];
    squares += quat[k] * quat[k];
  }
  quat[packed.largest] = std::sqrt(squares < 1 ? 1 - squares : 0.0f);
}

}  // namespace anchorsplat
