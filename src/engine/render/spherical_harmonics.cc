#include "render/spherical_harmonics.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/gaussian_cloud.h"
#include "core/parallel.h"
#include "core/spherical_harmonics.h"
#include "render/project.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "render/spherical_harmonics.cc"
// foreach_target compiles this file once per instruction set, so it must come first.
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#include "render/spherical_harmonics_basis-inl.h"
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace anchorsplat {
namespace HWY_NAMESPACE {
namespace {

// Σ_k Y_k·sh[k], with three channels in a 128-bit register (the fourth lane is the next coefficient's red, ignored).
// The last coefficient is added separately, as a fourth float after it may not exist.
HWY_INLINE void Sum(const ShBasisBatch& b, size_t j, int coefficients, const float* HWY_RESTRICT sh,
                    float* HWY_RESTRICT rgb) {
  const int last = coefficients - 1;
#if HWY_TARGET == HWY_SCALAR
  rgb[0] = rgb[1] = rgb[2] = 0.0f;
  for (int k = 0; k < last; ++k) {
    for (int c = 0; c < 3; ++c) rgb[c] += b.value[k][j] * sh[3 * k + c];
  }
#else
  const hn::FixedTag<float, 4> d4;
  auto even = hn::Zero(d4), odd = hn::Zero(d4);  // two chains, to hide the latency of additions
  int k = 0;
  for (; k + 1 < last; k += 2) {
    even = hn::MulAdd(hn::Set(d4, b.value[k][j]), hn::LoadU(d4, sh + 3 * k), even);
    odd = hn::MulAdd(hn::Set(d4, b.value[k + 1][j]), hn::LoadU(d4, sh + 3 * (k + 1)), odd);
  }
  if (k < last) even = hn::MulAdd(hn::Set(d4, b.value[k][j]), hn::LoadU(d4, sh + 3 * k), even);
  alignas(16) float sums[4];
  hn::Store(hn::Add(even, odd), d4, sums);
  std::copy_n(sums, 3, rgb);
#endif
  for (int c = 0; c < 3; ++c) rgb[c] += b.value[last][j] * sh[3 * last + c];
}

// The same for coefficients that overflow a float sum: keeps the brightness, but small enough for pictures to add some.
// False if a coefficient is not finite.
bool SumOfHuge(const ShBasisBatch& b, size_t j, int coefficients, const float* sh, float* rgb) {
  constexpr double kBrightest = 1e30;
  bool finite = true;
  for (int c = 0; c < 3; ++c) {
    double sum = 0.5;
    for (int k = 0; k < coefficients; ++k) sum += double{b.value[k][j]} * double{sh[3 * k + c]};
    finite = finite && std::isfinite(sum);
    rgb[c] = static_cast<float>(std::clamp(sum, -kBrightest, kBrightest));
  }
  return finite;
}

void EvaluateChunk(const SphericalHarmonicsParams& p, int64_t chunk) {
  ShBasisBatch b;
  const size_t lanes = hn::Lanes(ShTag());
  const int coefficients = ShCoefficients(p.degree);
  int32_t* visible = p.visible + chunk * kProjectChunk;
  const size_t count = static_cast<size_t>(p.visible_counts[chunk]);
  size_t kept = 0;
  for (size_t begin = 0; begin < count; begin += kShBatch) {
    const size_t n = std::min(kShBatch, count - begin);
    LoadDirections(
        n, [&](size_t j) { return p.means + 3 * int64_t{visible[begin + j]}; }, p.center, b);
    for (size_t j = 0; j < n; j += lanes) EvaluateBasis(p.degree, j, b);
    for (size_t j = 0; j < n; ++j) {
      const int32_t i = visible[begin + j];
      float rgb[3];
      Sum(b, j, coefficients, p.sh + i * p.stride, rgb);
      bool finite = true;
      for (int c = 0; c < 3; ++c) {
        rgb[c] += 0.5f;
        finite = finite && std::abs(rgb[c]) <= std::numeric_limits<float>::max();  // also false for NaN
      }
      if (!finite && !SumOfHuge(b, j, coefficients, p.sh + i * p.stride, rgb)) {
        p.tiles[i] = TileRect{};
        continue;
      }
      for (int c = 0; c < 3; ++c) p.projected[i].rgb[c] = std::max(rgb[c], 0.0f);
      visible[kept++] = i;  // kept ≤ begin + j: never overtakes reading
    }
  }
  p.visible_counts[chunk] = static_cast<int32_t>(kept);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace anchorsplat
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace anchorsplat {

HWY_EXPORT(EvaluateChunk);

void SphericalHarmonicsCpu(const SphericalHarmonicsParams& p) {
  ParallelFor(0, ProjectChunks(p.count), 1, [&p](int64_t first, int64_t last) {
    for (int64_t chunk = first; chunk < last; ++chunk) HWY_DYNAMIC_DISPATCH(EvaluateChunk)(p, chunk);
  });
}

}  // namespace anchorsplat
#endif
