#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/cloud_view.h"
#include "core/gaussian_cloud.h"
#include "formats/axes.h"

namespace anchorsplat {

// The body of an SPZ file: consecutive sections with one little-endian record per Gaussian.
//
//   means      3 × 24-bit fixed point with `fractional_bits`; version 1: 3 × half float
//   alphas     opacity·255
//   colors     3 × (f_dc·0.15·255 + 127.5)
//   scales     3 × ((log-scale + 10)·16)
//   rotations  version 1, 2: x y z of the quaternion with w ≥ 0, ·127.5 + 127.5; version 3 on: 32 bits, highest first
//              2 for the index of the largest component (order x y z w), then 3 × (sign, 9 bits of |q|·√2·511)
//   harmonics  coefficient-major, value·128 + 128; written in steps of 8 (degree 1) and 16, so that they compress
enum class SpzSection { kMeans, kAlphas, kColors, kScales, kRotations, kHarmonics };
inline constexpr std::array<SpzSection, 6> kSpzSections = {SpzSection::kMeans,     SpzSection::kAlphas,
                                                           SpzSection::kColors,    SpzSection::kScales,
                                                           SpzSection::kRotations, SpzSection::kHarmonics};

inline constexpr uint32_t kSpzMagic = 0x5053474e;  // "NGSP"
inline constexpr uint8_t kSpzAntialiased = 1;      // bits of the header's flags
inline constexpr uint8_t kSpzHasExtensions = 2;
inline constexpr int kMaxSpzShDegree = 4;  // one more than a cloud; its coefficients are dropped

// Properties of the sections, from the header.
struct SpzLayout {
  int version = 4;
  int sh_degree = 0;  // in the file
  int fractional_bits = 12;

  size_t record_size(SpzSection section) const;  // bytes per Gaussian
  size_t record_size() const;                    // of all sections
};

// Unpacks records [first, last) of a section into the cloud, which has its final size. `flip` converts from the file's
// axes.
void UnpackSpz(const SpzLayout& layout, SpzSection section, int64_t first, int64_t last, const uint8_t* bytes,
               const AxisFlip& flip, GaussianCloud& cloud);

// The inverse, from version 3 on; record i is Gaussian order[i], or i if `order` is empty. `flip` converts to the
// file's axes.
void PackSpz(const SpzLayout& layout, SpzSection section, int64_t first, int64_t last, const CloudView& cloud,
             std::span<const uint32_t> order, const AxisFlip& flip, uint8_t* bytes);

}  // namespace anchorsplat
