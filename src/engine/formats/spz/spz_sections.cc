#include "formats/spz/spz_sections.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "core/activations.h"
#include "core/half.h"
#include "core/spherical_harmonics.h"
#include "formats/quantize.h"
#include "io/little_endian.h"

namespace anchorsplat {

namespace {

static_assert(std::endian::native == std::endian::little, "rotations are copied as they lie in memory");

// Wider than 0–1, to preserve colours that higher SH bring back into range.
constexpr float kColorScale = 0.15f * 255;
constexpr float kRotationSteps = 511;

using ByteTable = std::array<float, 256>;
template <typename Function>
ByteTable Table(Function&& value) {
  ByteTable table{};
  for (size_t k = 0; k < table.size(); ++k) table[k] = value(static_cast<float>(k));
  return table;
}

float FixedPoint(const uint8_t* bytes, float step) {
  const uint32_t bits = uint32_t{bytes[0]} << 8 | uint32_t{bytes[1]} << 16 | uint32_t{bytes[2]} << 24;
  return static_cast<float>(static_cast<int32_t>(bits) >> 8) * step;  // arithmetic shift keeps the sign
}

void UnpackRotation(const SpzLayout& layout, const uint8_t* bytes, float xyzw[4]) {
  if (layout.version < 3) {
    float squares = 0;
    for (int k = 0; k < 3; ++k) {
      xyzw[k] = static_cast<float>(bytes[k]) / 127.5f - 1;
      squares += xyzw[k] * xyzw[k];
    }
    xyzw[3] = std::sqrt(std::max(0.0f, 1 - squares));
    return;
  }
  uint32_t bits;
  std::memcpy(&bits, bytes, sizeof bits);
  SmallestThree three;
  three.largest = bits >> 30;
  for (int k = 0; k < 3; ++k) {
    const uint32_t component = bits >> (20 - 10 * k) & 1023;
    const float magnitude = kSqrtHalf * static_cast<float>(component & 511) / kRotationSteps;
    three.rest[k] = (component & 512) != 0 ? -magnitude : magnitude;
  }
  RestoreLargest(three, xyzw);
}

uint32_t PackRotation(const float xyzw[4]) {
  const SmallestThree three = DropLargest(xyzw, 3);
  uint32_t bits = three.largest;
  for (const float component : three.rest) {
    const uint32_t magnitude = QuantizeUnit(std::fabs(component) / kSqrtHalf, 511);
    bits = bits << 10 | (component < 0 ? 512u : 0u) | magnitude;
  }
  return bits;
}

// Rounds to the nearest multiple of `step`, a power of two: zeroed lower bits compress well. A single rounding:
// rounding to integers first could give the wrong multiple.
uint8_t QuantizeHarmonic(float value, int step) {
  const float shifted = std::isnan(value) ? 128.0f : value * 128 + 128;
  const float bounded = shifted > 0 ? (shifted < 255 ? shifted : 255.0f) : 0.0f;
  const auto nearest = static_cast<int32_t>(bounded / static_cast<float>(step) + 0.5f) * step;
  return static_cast<uint8_t>(std::min(nearest, 255));
}

}  // namespace

size_t SpzLayout::record_size(SpzSection section) const {
  switch (section) {
    case SpzSection::kMeans:
      return version == 1 ? 6 : 9;
    case SpzSection::kAlphas:
      return 1;
    case SpzSection::kColors:
    case SpzSection::kScales:
      return 3;
    case SpzSection::kRotations:
      return version < 3 ? 3 : 4;
    default:
      return static_cast<size_t>(3 * (ShCoefficients(sh_degree) - 1));
  }
}

size_t SpzLayout::record_size() const {
  size_t sum = 0;
  for (const SpzSection section : kSpzSections) sum += record_size(section);
  return sum;
}

void UnpackSpz(const SpzLayout& layout, SpzSection section, int64_t first, int64_t last, const uint8_t* bytes,
               const AxisFlip& flip, GaussianCloud& cloud) {
  const size_t record = layout.record_size(section);
  switch (section) {
    case SpzSection::kMeans: {
      const float step = std::ldexp(1.0f, -layout.fractional_bits);
      float* out = cloud.means.data() + 3 * first;
      for (int64_t i = first; i < last; ++i) {
        for (size_t k = 0; k < 3; ++k, bytes += record / 3) {
          *out++ = flip.mean[k] *
                   (layout.version == 1 ? FloatFromHalf(LoadLittleEndian<uint16_t>(bytes)) : FixedPoint(bytes, step));
        }
      }
      return;
    }
    case SpzSection::kAlphas: {
      static const ByteTable kLogits = Table([](float byte) { return LogitFromOpacity(byte / 255); });
      for (int64_t i = first; i < last; ++i) cloud.opacity_logits[static_cast<size_t>(i)] = kLogits[*bytes++];
      return;
    }
    case SpzSection::kColors: {
      static const ByteTable kColors = Table([](float byte) { return (byte - 127.5f) / kColorScale; });
      for (int64_t i = first; i < last; ++i) {
        float* dc = cloud.sh.data() + i * cloud.sh_stride();
        for (int k = 0; k < 3; ++k) dc[k] = kColors[*bytes++];
      }
      return;
    }
    case SpzSection::kScales: {
      float* out = cloud.log_scales.data() + 3 * first;
      for (int64_t k = 0; k < 3 * (last - first); ++k) *out++ = static_cast<float>(*bytes++) / 16 - 10;
      return;
    }
    case SpzSection::kRotations:
      for (int64_t i = first; i < last; ++i, bytes += record) {
        float xyzw[4];
        UnpackRotation(layout, bytes, xyzw);
        float* quat = cloud.quats.data() + 4 * i;
        quat[0] = xyzw[3];
        for (size_t k = 0; k < 3; ++k) quat[k + 1] = flip.quat[k + 1] * xyzw[k];
      }
      return;
    case SpzSection::kHarmonics: {
      const auto kept = static_cast<size_t>(cloud.sh_stride()) - 3;
      for (int64_t i = first; i < last; ++i, bytes += record) {
        float* out = cloud.sh.data() + i * cloud.sh_stride() + 3;
        for (size_t k = 0; k < kept; ++k) out[k] = flip.sh[k / 3 + 1] * ((static_cast<float>(bytes[k]) - 128) / 128);
      }
      return;
    }
  }
}

void PackSpz(const SpzLayout& layout, SpzSection section, int64_t first, int64_t last, const CloudView& cloud,
             std::span<const uint32_t> order, const AxisFlip& flip, uint8_t* bytes) {
  const auto row = [&](int64_t i) { return order.empty() ? i : int64_t{order[static_cast<size_t>(i)]}; };
  switch (section) {
    case SpzSection::kMeans: {
      const float steps = std::ldexp(1.0f, layout.fractional_bits);
      constexpr float kLimit = (1 << 23) - 1;
      for (int64_t i = first; i < last; ++i) {
        const float* mean = cloud.means.data() + 3 * row(i);
        for (size_t k = 0; k < 3; ++k) {
          const float scaled = flip.mean[k] * mean[k] * steps;
          const float bounded = scaled > -kLimit ? (scaled < kLimit ? scaled : kLimit) : -kLimit;
          const auto fixed = std::isnan(scaled) ? 0 : static_cast<int32_t>(std::lrint(bounded));
          for (int shift = 0; shift < 24; shift += 8) *bytes++ = static_cast<uint8_t>(fixed >> shift & 255);
        }
      }
      return;
    }
    case SpzSection::kAlphas:
      for (int64_t i = first; i < last; ++i) {
        *bytes++ = OpacityByte(cloud.opacity_logits[static_cast<size_t>(row(i))]);
      }
      return;
    case SpzSection::kColors:
      for (int64_t i = first; i < last; ++i) {
        const float* dc = cloud.sh.data() + row(i) * cloud.sh_stride();
        for (int k = 0; k < 3; ++k) *bytes++ = QuantizeByte(dc[k] * kColorScale + 127.5f);
      }
      return;
    case SpzSection::kScales:
      for (int64_t i = first; i < last; ++i) {
        const float* scale = cloud.log_scales.data() + 3 * row(i);
        for (int k = 0; k < 3; ++k) *bytes++ = QuantizeByte((scale[k] + 10) * 16);
      }
      return;
    case SpzSection::kRotations:
      for (int64_t i = first; i < last; ++i, bytes += sizeof(uint32_t)) {
        const float* quat = cloud.quats.data() + 4 * row(i);
        const float xyzw[4] = {flip.quat[1] * quat[1], flip.quat[2] * quat[2], flip.quat[3] * quat[3], quat[0]};
        const uint32_t bits = PackRotation(xyzw);
        std::memcpy(bytes, &bits, sizeof bits);
      }
      return;
    case SpzSection::kHarmonics: {
      const int64_t rest = cloud.sh_stride() - 3;
      std::array<float, 45> signs{};
      for (size_t k = 0; k < signs.size(); ++k) signs[k] = flip.sh[k / 3 + 1];
      for (int64_t i = first; i < last; ++i) {
        const float* sh = cloud.sh.data() + row(i) * cloud.sh_stride() + 3;
        const int64_t degree1 = std::min<int64_t>(9, rest);
        for (int64_t k = 0; k < degree1; ++k) *bytes++ = QuantizeHarmonic(signs[static_cast<size_t>(k)] * sh[k], 8);
        for (int64_t k = 9; k < rest; ++k) *bytes++ = QuantizeHarmonic(signs[static_cast<size_t>(k)] * sh[k], 16);
      }
      return;
    }
  }
}

}  // namespace anchorsplat
