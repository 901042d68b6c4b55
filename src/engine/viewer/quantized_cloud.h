#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/cloud_view.h"
#include "core/result.h"

namespace anchorsplat {

// A cloud as the page carries it: integers in byte planes, Gaussians in Morton order, so that neighbours in the file
// are neighbours in space and the high bytes deflate well. The steps are small enough that a render differs from the
// original's by less than 45 dB PSNR can show.
//
// value            code                                                    bits
// mean, per axis   t = asinh((x − center)/spread) over [−reach, reach]     20   fine near the middle, and one stray
//                                                                               Gaussian far out costs nobody precision
// log-scale        over [log_scale_min, log_scale_max]                     10   step < 3.2 % of the length, far less
// for any sane file opacity          0–1 (after the sigmoid)                                 10 f_dc             over
// [dc_min, dc_max]                                   10 rotation         smallest three of the unit quaternion 32   2
// bits which one is left out, 3 × 10 f_rest           m·t·|t|, t = q/31, m per degree                          6   fine
// where most coefficients are
//
// Linear codes put 0 at the lower end and 2^bits − 1 at the upper. A value of b > 8 bits takes ceil(b/8) planes, the
// top 8 bits first; the last plane holds what is left, in its low bits.
inline constexpr int kMeanBits = 20;
inline constexpr int kScalarBits = 10;
inline constexpr int kHarmonicTop = 31;  // codes −31…31

struct QuantizedCloud {
  int64_t count = 0;
  int sh_degree = 0;
  std::array<double, 3> center{};     // world: median of the means
  double spread = 1;                  // world units: 90 % of the means are this near to the centre, per axis
  double reach = 0;                   // largest |t| of any mean
  std::array<double, 2> log_scale{};  // min, max
  std::array<double, 2> dc{};         // min, max
  std::array<double, 3> sh_max{};     // m of degree 1, 2, 3
  // World units, per axis from the centre: half the size of what one wants to see, most of the Gaussians, but of a
  // scene with a far background its middle.
  double radius = 1;
  int64_t left_out = 0;  // Gaussians that are not usable: no rasterizer draws them
  // PlanesPerGaussian(sh_degree) planes of `count` bytes: mean x, y, z (3 each); log-scale 0–2, opacity, f_dc r, g, b
  // (2 each); rotation (4, lowest byte first); f_rest coefficient-major, rgb fastest (1 each, two's complement).
  std::vector<uint8_t> planes;
};

constexpr int PlanesPerGaussian(int sh_degree) { return 3 * 3 + 7 * 2 + 4 + 3 * (ShCoefficients(sh_degree) - 1); }

// Keeps SH up to `max_sh_degree`. kBadArgument: an invalid cloud, or one without any usable Gaussian.
Result<QuantizedCloud> Quantize(const CloudView& cloud, int max_sh_degree);

// The same by parts, for splats whose planes are not to be in memory all at once.
//
// All but the planes, and the rows of usable Gaussians in the order of the cloud. Errors: those of Quantize.
struct MeasuredCloud {
  QuantizedCloud scale;
  std::vector<int64_t> rows;
};
Result<MeasuredCloud> MeasureCloud(const CloudView& cloud, int max_sh_degree);
// Planes of these rows alone, which are put into Morton order.
std::vector<uint8_t> PlanesOf(const CloudView& cloud, const QuantizedCloud& scale, std::span<const int64_t> rows);

}  // namespace anchorsplat
