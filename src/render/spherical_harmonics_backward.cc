#include "render/spherical_harmonics_backward.h"

#include <hwy/cache_control.h>

#include <algorithm>
#include <cstddef>

#include "core/gaussian_cloud.h"
#include "core/spherical_harmonics.h"
#include "render/project.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "render/spherical_harmonics_backward.cc"
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

constexpr ptrdiff_t kAhead = 24;  // Gaussians that are fetched ahead: rows are large and not all of them are needed
constexpr int kFloatsPerLine = 16;

// ∂Y_k/∂(x, y, z) of the formulas as they stand, at unit directions.
struct BasisSlopes {
  alignas(64) float slope[3][kShCoefficientsAtMost][kShBatch];
};

HWY_INLINE void EvaluateSlopes(int degree, size_t j, const ShBasisBatch& b, BasisSlopes& s) {
  if (degree < 1) return;
  const ShTag d;
  const ShVector x = hn::Load(d, b.direction[0] + j), y = hn::Load(d, b.direction[1] + j),
                 z = hn::Load(d, b.direction[2] + j);
  const auto c = [d](float value) HWY_ATTR { return hn::Set(d, value); };
  const ShVector zero = hn::Zero(d);
  const auto put = [&s, d, j](size_t k, ShVector sx, ShVector sy, ShVector sz) HWY_ATTR {
    hn::Store(sx, d, s.slope[0][k] + j);
    hn::Store(sy, d, s.slope[1][k] + j);
    hn::Store(sz, d, s.slope[2][k] + j);
  };
  put(1, zero, c(-kSh1), zero);
  put(2, zero, zero, c(kSh1));
  put(3, c(-kSh1), zero, zero);
  if (degree < 2) return;
  const auto times = [d](float f, ShVector a) HWY_ATTR { return hn::Mul(hn::Set(d, f), a); };
  put(4, times(kSh2[0], y), times(kSh2[0], x), zero);
  put(5, zero, times(-kSh2[0], z), times(-kSh2[0], y));
  put(6, zero, zero, times(2 * kSh2[1], z));
  put(7, times(-kSh2[0], z), zero, times(-kSh2[0], x));
  put(8, times(2 * kSh2Diagonal, x), times(-2 * kSh2Diagonal, y), zero);
  if (degree < 3) return;
  const ShVector xx = hn::Mul(x, x), yy = hn::Mul(y, y), zz = hn::Mul(z, z), xy = hn::Mul(x, y), xz = hn::Mul(x, z),
                 yz = hn::Mul(y, z), difference = hn::Sub(xx, yy);
  const ShVector ring = hn::NegMulAdd(c(kSh3[3]), zz, c(kSh3[2]));
  put(9, times(-6 * kSh3[0], xy), times(-3 * kSh3[0], difference), zero);
  put(10, times(kSh3[1], yz), times(kSh3[1], xz), times(kSh3[1], xy));
  put(11, zero, ring, times(-2 * kSh3[3], yz));
  put(12, zero, zero, hn::MulSub(c(3 * kSh3[4]), zz, c(kSh3[5])));
  put(13, ring, zero, times(-2 * kSh3[3], xz));
  put(14, times(2 * kSh3[6], xz), times(-2 * kSh3[6], yz), times(kSh3[6], difference));
  put(15, times(-3 * kSh3[0], difference), times(6 * kSh3[0], xy), zero);
}

// sh_gradient[k] = Y_k·g for all coefficients.
HWY_INLINE void Spread(const ShBasisBatch& b, size_t j, int coefficients, const float* g, float* HWY_RESTRICT out) {
  const int last = coefficients - 1;
#if HWY_TARGET == HWY_SCALAR
  for (int k = 0; k < last; ++k) {
    for (int c = 0; c < 3; ++c) out[3 * k + c] = b.value[k][j] * g[c];
  }
#else
  // Four floats at a time, of which the next coefficient's store overwrites the fourth.
  const hn::FixedTag<float, 4> d4;
  const auto g4 = hn::Load(d4, g);
  for (int k = 0; k < last; ++k) hn::StoreU(hn::Mul(hn::Set(d4, b.value[k][j]), g4), d4, out + 3 * k);
#endif
  for (int c = 0; c < 3; ++c) out[3 * last + c] = b.value[last][j] * g[c];
}

// ∂L/∂direction = Σ_k ∇Y_k·(sh[k]·g); Y_0 has no slope.
HWY_INLINE void DirectionGradient(const BasisSlopes& s, size_t j, int coefficients, const float* HWY_RESTRICT sh,
                                  const float* g, float* out) {
#if HWY_TARGET == HWY_SCALAR
  for (int a = 0; a < 3; ++a) out[a] = 0;
  for (int k = 1; k < coefficients; ++k) {
    const float along = sh[3 * k] * g[0] + sh[3 * k + 1] * g[1] + sh[3 * k + 2] * g[2];
    for (int a = 0; a < 3; ++a) out[a] += s.slope[a][k][j] * along;
  }
#else
  // Reads from the float before the coefficient's red, so that nothing behind the last coefficient is touched; its lane
  // is multiplied by 0 at the end.
  const hn::FixedTag<float, 4> d4;
  auto x = hn::Zero(d4), y = hn::Zero(d4), z = hn::Zero(d4);
  for (int k = 1; k < coefficients; ++k) {
    const auto rgb = hn::LoadU(d4, sh + 3 * k - 1);
    x = hn::MulAdd(hn::Set(d4, s.slope[0][k][j]), rgb, x);
    y = hn::MulAdd(hn::Set(d4, s.slope[1][k][j]), rgb, y);
    z = hn::MulAdd(hn::Set(d4, s.slope[2][k][j]), rgb, z);
  }
  alignas(16) float sums[3][4];
  hn::Store(x, d4, sums[0]);
  hn::Store(y, d4, sums[1]);
  hn::Store(z, d4, sums[2]);
  for (int a = 0; a < 3; ++a) out[a] = sums[a][1] * g[0] + sums[a][2] * g[1] + sums[a][3] * g[2];
#endif
}

void BackwardChunk(const SphericalHarmonicsBackwardParams& p, int64_t chunk) {
  const int64_t first = chunk * kProjectChunk, rows_of_chunk = std::min(kProjectChunk, p.count - first);
  const size_t lanes = hn::Lanes(ShTag());
  const int coefficients = ShCoefficients(p.degree);
  ShBasisBatch b;
  BasisSlopes s;
  struct Row {
    int64_t row;
    alignas(16) float g[4];  // rgb, 0
  } batch[kShBatch];
  const int32_t* visible = p.visible + first;
  const int32_t* end = visible + p.visible_counts[chunk];
  int64_t written = first;  // rows below are final
  while (visible != end) {
    size_t n = 0;
    for (; visible != end && n < kShBatch; ++visible) {
      if (visible + kAhead < end) {
        hwy::Prefetch(p.gradients + visible[kAhead]);
        hwy::Prefetch(p.projected + visible[kAhead]);
      }
      const ProjectedGaussian& projected = p.projected[*visible];
      Row& row = batch[n];
      row.row = *visible;
      for (int c = 0; c < 3; ++c) row.g[c] = projected.rgb[c] > 0 ? p.gradients[row.row].rgb[c] : 0.0f;
      row.g[3] = 0;
      // Hidden ones have no gradient, and they are many.
      n += !(row.g[0] == 0 && row.g[1] == 0 && row.g[2] == 0);
    }
    if (n == 0) break;
    LoadDirections(
        n, [&](size_t j) { return p.means + 3 * batch[j].row; }, p.center, b);
    for (size_t j = 0; j < n; j += lanes) {
      EvaluateBasis(p.degree, j, b);
      EvaluateSlopes(p.degree, j, b, s);
    }
    for (size_t j = 0; j < n; ++j) {
      const auto& [i, g] = batch[j];
      // Of dense splats nearly all are needed; fetched one by one, as many at once wait for each other.
      if (const int64_t next = i + kAhead; next < p.count) {
        for (int k = 0; k < 3 * coefficients; k += kFloatsPerLine) {
          hwy::Prefetch(p.sh + next * p.stride + k);
          hwy::Prefetch(p.sh_gradients + next * p.stride + k);
        }
      }
      std::fill(p.sh_gradients + written * p.stride, p.sh_gradients + i * p.stride, 0.0f);
      written = i + 1;
      float* out = p.sh_gradients + i * p.stride;
      Spread(b, j, coefficients, g, out);
      std::fill(out + 3 * coefficients, out + p.stride, 0.0f);
      if (p.degree < 1) continue;
      float along[3];
      DirectionGradient(s, j, coefficients, p.sh + i * p.stride, g, along);
      // Through the normalisation: what points along the ray changes nothing.
      const float x = b.direction[0][j], y = b.direction[1][j], z = b.direction[2][j];
      const float radial = along[0] * x + along[1] * y + along[2] * z;
      float* mean = p.mean_gradients + 3 * i;
      mean[0] += b.inverse_distance[j] * (along[0] - radial * x);
      mean[1] += b.inverse_distance[j] * (along[1] - radial * y);
      mean[2] += b.inverse_distance[j] * (along[2] - radial * z);
    }
  }
  std::fill(p.sh_gradients + written * p.stride, p.sh_gradients + (first + rows_of_chunk) * p.stride, 0.0f);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace anchorsplat
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace anchorsplat {

HWY_EXPORT(BackwardChunk);

void SphericalHarmonicsBackwardCpu(const SphericalHarmonicsBackwardParams& p, int64_t chunk) {
  HWY_DYNAMIC_DISPATCH(BackwardChunk)(p, chunk);
}

}  // namespace anchorsplat
#endif
