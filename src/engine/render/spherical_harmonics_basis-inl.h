// Spherical harmonics of a batch of directions, for forward and backward. Compiled once per instruction set, as
// <hwy/highway.h>.

#if defined(ANCHORSPLAT_RENDER_SPHERICAL_HARMONICS_BASIS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef ANCHORSPLAT_RENDER_SPHERICAL_HARMONICS_BASIS_INL_H_
#undef ANCHORSPLAT_RENDER_SPHERICAL_HARMONICS_BASIS_INL_H_
#else
#define ANCHORSPLAT_RENDER_SPHERICAL_HARMONICS_BASIS_INL_H_
#endif

#include <hwy/highway.h>

#include <array>
#include <cstddef>

#include "core/spherical_harmonics.h"

HWY_BEFORE_NAMESPACE();
namespace anchorsplat {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using ShTag = hn::CappedTag<float, 16>;
using ShVector = hn::Vec<ShTag>;

constexpr size_t kShBatch = 64;
constexpr size_t kShCoefficientsAtMost = 16;

struct ShBasisBatch {
  alignas(64) float direction[3][kShBatch];  // from the camera; EvaluateBasis normalises it
  alignas(64) float inverse_distance[kShBatch];
  alignas(64) float value[kShCoefficientsAtMost][kShBatch];  // Y_k
};

// Loads directions to the n ≤ kShBatch means at mean(j).
template <typename Mean>
HWY_INLINE void LoadDirections(size_t n, const Mean& mean, const std::array<double, 3>& center, ShBasisBatch& b) {
  for (size_t j = 0; j < n; ++j) {
    const float* m = mean(j);
    // Subtract in double: far from the origin floats lack the precision.
    for (size_t a = 0; a < 3; ++a) b.direction[a][j] = static_cast<float>(m[a] - center[a]);
  }
  for (size_t j = n; j < (n + 15) / 16 * 16; ++j) {  // unused lanes
    for (size_t a = 0; a < 3; ++a) b.direction[a][j] = 1.0f;
  }
}

// Evaluates Y_0 … of the degree for one register of directions.
HWY_INLINE void EvaluateBasis(int degree, size_t j, ShBasisBatch& b) {
  const ShTag d;
  const auto c = [d](float value) HWY_ATTR { return hn::Set(d, value); };
  ShVector x = hn::Load(d, b.direction[0] + j), y = hn::Load(d, b.direction[1] + j),
           z = hn::Load(d, b.direction[2] + j);
  const ShVector norm2 = hn::MulAdd(x, x, hn::MulAdd(y, y, hn::Mul(z, z)));
  const ShVector inverse = hn::Div(c(1.0f), hn::Sqrt(norm2));
  x = hn::Mul(x, inverse), y = hn::Mul(y, inverse), z = hn::Mul(z, inverse);
  hn::Store(x, d, b.direction[0] + j);
  hn::Store(y, d, b.direction[1] + j);
  hn::Store(z, d, b.direction[2] + j);
  hn::Store(inverse, d, b.inverse_distance + j);
  const auto put = [&b, j](size_t k, ShVector value) HWY_ATTR { hn::Store(value, ShTag(), b.value[k] + j); };
  put(0, c(kSh0));
  if (degree < 1) return;
  put(1, hn::Mul(c(-kSh1), y));
  put(2, hn::Mul(c(kSh1), z));
  put(3, hn::Mul(c(-kSh1), x));
  if (degree < 2) return;
  const ShVector xx = hn::Mul(x, x), yy = hn::Mul(y, y), zz = hn::Mul(z, z), xy = hn::Mul(x, y);
  const ShVector difference = hn::Sub(xx, yy);
  put(4, hn::Mul(c(kSh2[0]), xy));
  put(5, hn::Mul(c(-kSh2[0]), hn::Mul(y, z)));
  put(6, hn::MulSub(c(kSh2[1]), zz, c(kSh2[2])));
  put(7, hn::Mul(c(-kSh2[0]), hn::Mul(x, z)));
  put(8, hn::Mul(c(kSh2Diagonal), difference));
  if (degree < 3) return;
  const ShVector ring = hn::NegMulAdd(c(kSh3[3]), zz, c(kSh3[2]));
  const ShVector three = c(3.0f);
  put(9, hn::Mul(hn::Mul(c(-kSh3[0]), y), hn::MulSub(three, xx, yy)));
  put(10, hn::Mul(c(kSh3[1]), hn::Mul(xy, z)));
  put(11, hn::Mul(y, ring));
  put(12, hn::Mul(z, hn::MulSub(c(kSh3[4]), zz, c(kSh3[5]))));
  put(13, hn::Mul(x, ring));
  put(14, hn::Mul(hn::Mul(c(kSh3[6]), z), difference));
  put(15, hn::Mul(hn::Mul(c(-kSh3[0]), x), hn::NegMulAdd(three, yy, xx)));
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace anchorsplat
HWY_AFTER_NAMESPACE();

#endif  // per target
