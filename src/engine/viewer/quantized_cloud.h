#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/cloud_view.h"
#include "core/result.h"

namespace anchorsplat {

// A cloud as stored in the page: integers in byte planes, Gaussians in Morton order, so that neighbours in the file are
// neighbours in space and high bytes deflate well. Steps are fine enough that renders differ from the original's by at
// most what 45 dB PSNR shows.
//
//   value      code                                                  bits  why
//   mean       t = asinh((x − center)/spread) over [−reach, reach]   20    per axis; fine near the centre, and a stray
//                                                                          Gaussian far out costs no precision
//   log-scale  over [log_scale_min, log_scale_max]                   10    step < 3.2 % of the length, far less usually
//   opacity    0–1 (after the sigmoid)                               10
//   f_dc       over [dc_min, dc_max]                                 10
//   rotation   smallest three of the unit quaternion                 32    2 bits for the omitted one, 3 × 10
//   f_rest     m·t·|t|, t = q/31, m per degree                       6     fine near 0, where most coefficients are
//
// Linear codes map the lower end to 0 and the upper to 2^bits − 1. A value of b > 8 bits takes ceil(b/8) planes, top 8
// bits first; the last plane has the remaining bits in its low bits.
inline constexpr int kMeanBits = 20;
inline constexpr int kScalarBits = 10;
inline constexpr int kHarmonicTop = 31;  // codes −31…31

struct QuantizedCloud {
  int64_t count = 0;
  int sh_degree = 0;
  std::array<double, 3> center{};     // world: median of the means
  double spread = 1;                  // world units: distance from the centre that holds 90 % of the means, per axis
  double reach = 0;                   // largest |t| of any mean
  std::array<double, 2> log_scale{};  // min, max
  std::array<double, 2> dc{};         // min, max
  std::array<double, 3> sh_max{};     // m of degree 1, 2, 3
  // World units, per axis from the centre: half the size of what is worth seeing. That is most Gaussians, or in scenes
  // with a far background the middle.
  double radius = 1;
  int64_t left_out = 0;  // unusable Gaussians, which no rasterizer draws
  // PlanesPerGaussian(sh_degree) planes of `count` bytes: mean x, y, z (3 each); log-scale 0–2, opacity, f_dc r, g, b
  // (2 each); rotation (4, lowest byte first); f_rest coefficient-major, rgb fastest (1 each, two's complement).
  std::vector<uint8_t> planes;
};

constexpr int PlanesPerGaussian(int sh_degree) { return 3 * 3 + 7 * 2 + 4 + 3 * (ShCoefficients(sh_degree) - 1); }

// Quantises a cloud with SH up to `max_sh_degree`. kBadArgument: an invalid cloud, or one without usable Gaussians.
Result<QuantizedCloud> Quantize(const CloudView& cloud, int max_sh_degree);

// The same in parts, for splats whose planes do not fit into memory.
//
// First everything but the planes, and the rows of usable Gaussians in cloud order. Errors: those of Quantize.
struct MeasuredCloud {
  QuantizedCloud scale;
  std::vector<int64_t> rows;
};
Result<MeasuredCloud> MeasureCloud(const CloudView& cloud, int max_sh_degree);
// Then the planes of some rows, in Morton order.
std::vector<uint8_t> PlanesOf(const CloudView& cloud, const QuantizedCloud& scale, std::span<const int64_t> rows);

}  // namespace anchorsplat
