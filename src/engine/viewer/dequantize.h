#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>

#include "core/gaussian_cloud.h"
#include "viewer/quantized_cloud.h"

namespace anchorsplat {

// Decodes planes into a cloud, in their order. Written from the table in quantized_cloud.h, as the page's worker.js is.
inline GaussianCloud Dequantize(const QuantizedCloud& q) {
  GaussianCloud cloud;
  cloud.Resize(q.count, q.sh_degree);
  const auto n = static_cast<size_t>(q.count);
  size_t plane = 0;
  const auto code = [&](size_t i, int bits) {
    uint32_t value = 0;
    size_t k = plane;
    for (; bits > 0; bits -= 8, ++k) value = value << std::min(bits, 8) | q.planes[k * n + i];
    return value;
  };
  const auto linear = [&](size_t i, double low, double high) {
    return low + (high - low) * code(i, kScalarBits) / ((1 << kScalarBits) - 1);
  };
  for (size_t axis = 0; axis < 3; ++axis, plane += 3) {
    for (size_t i = 0; i < n; ++i) {
      const double t = q.reach * (2.0 * code(i, kMeanBits) / ((1 << kMeanBits) - 1) - 1);
      cloud.means[3 * i + axis] = static_cast<float>(q.center[axis] + q.spread * std::sinh(t));
    }
  }
  for (size_t k = 0; k < 3; ++k, plane += 2) {
    for (size_t i = 0; i < n; ++i) {
      cloud.log_scales[3 * i + k] = static_cast<float>(linear(i, q.log_scale[0], q.log_scale[1]));
    }
  }
  for (size_t i = 0; i < n; ++i) {
    const double opacity = linear(i, 0, 1);
    cloud.opacity_logits[i] = static_cast<float>(std::log(opacity / (1 - opacity)));
    if (opacity == 1) cloud.opacity_logits[i] = 30;  // a sigmoid of 1 in float
  }
  plane += 2;
  const auto stride = static_cast<size_t>(cloud.sh_stride());
  for (size_t c = 0; c < 3; ++c, plane += 2) {
    for (size_t i = 0; i < n; ++i) cloud.sh[stride * i + c] = static_cast<float>(linear(i, q.dc[0], q.dc[1]));
  }
  for (size_t i = 0; i < n; ++i) {
    uint32_t bits = 0;
    for (size_t k = 4; k-- > 0;) bits = bits << 8 | q.planes[(plane + k) * n + i];
    double left = 1;
    for (size_t k = 0, field = 0; k < 4; ++k) {
      if (k == bits >> 30) continue;
      const double c = ((bits >> (20 - 10 * field) & 1023) / 1023.0 * 2 - 1) * std::sqrt(0.5);
      cloud.quats[4 * i + k] = static_cast<float>(c);
      left -= c * c;
      ++field;
    }
    cloud.quats[4 * i + (bits >> 30)] = static_cast<float>(std::sqrt(std::max(0.0, left)));
  }
  plane += 4;
  for (size_t k = 3; k < stride; ++k, ++plane) {
    const double max = q.sh_max[k < 12 ? 0 : k < 27 ? 1 : 2];
    for (size_t i = 0; i < n; ++i) {
      const double t = static_cast<int8_t>(q.planes[plane * n + i]) / static_cast<double>(kHarmonicTop);
      cloud.sh[stride * i + k] = static_cast<float>(max * t * std::abs(t));
    }
  }
  return cloud;
}

}  // namespace anchorsplat
