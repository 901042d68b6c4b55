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
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace anchorsplat {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<float, 16>;
using V = hn::Vec<D>;

constexpr size_t kBatch = 64;
constexpr size_t kCoefficients = 16;

struct Basis {
  alignas(64) float direction[3][kBatch];          // not normalised
  alignas(64) float value[kCoefficients][kBatch];  // Y_k
};

HWY_INLINE V Constant(float x) { return hn::Set(D(), x); }

// Y_0 … Y_15 at one register of directions.
HWY_INLINE void EvaluateBasis(int degree, size_t j, Basis& b) {
  const D d;
  V x = hn::Load(d, b.direction[0] + j), y = hn::Load(d, b.direction[1] + j), z = hn::Load(d, b.direction[2] + j);
  const V norm2 = hn::MulAdd(x, x, hn::MulAdd(y, y, hn::Mul(z, z)));
  const V inverse = hn::Div(Constant(1.0f), hn::Sqrt(norm2));
  x = hn::Mul(x, inverse), y = hn::Mul(y, inverse), z = hn::Mul(z, inverse);
  const auto put = [&b, j](size_t k, V value) HWY_ATTR { hn::Store(value, D(), b.value[k] + j); };
  put(0, Constant(kSh0));
  if (degree < 1) return;
  put(1, hn::Mul(Constant(-kSh1), y));
  put(2, hn::Mul(Constant(kSh1), z));
  put(3, hn::Mul(Constant(-kSh1), x));
  if (degree < 2) return;
  const V xx = hn::Mul(x, x), yy = hn::Mul(y, y), zz = hn::Mul(z, z), xy = hn::Mul(x, y);
  const V difference = hn::Sub(xx, yy);
  put(4, hn::Mul(Constant(kSh2[0]), xy));
  put(5, hn::Mul(Constant(-kSh2[0]), hn::Mul(y, z)));
  put(6, hn::MulSub(Constant(kSh2[1]), zz, Constant(kSh2[2])));
  put(7, hn::Mul(Constant(-kSh2[0]), hn::Mul(x, z)));
  put(8, hn::Mul(Constant(kSh2Diagonal), difference));
  if (degree < 3) return;
  const V ring = hn::NegMulAdd(Constant(kSh3[3]), zz, Constant(kSh3[2]));
  const V three = Constant(3.0f);
  put(9, hn::Mul(hn::Mul(Constant(-kSh3[0]), y), hn::MulSub(three, xx, yy)));
  put(10, hn::Mul(Constant(kSh3[1]), hn::Mul(xy, z)));
  put(11, hn::Mul(y, ring));
  put(12, hn::Mul(z, hn::MulSub(Constant(kSh3[4]), zz, Constant(kSh3[5]))));
  put(13, hn::Mul(x, ring));
  put(14, hn::Mul(hn::Mul(Constant(kSh3[6]), z), difference));
  put(15, hn::Mul(hn::Mul(Constant(-kSh3[0]), x), hn::NegMulAdd(three, yy, xx)));
}

// Σ_k Y_k·sh[k], the three channels side by side in one 128-bit register (whose fourth lane is the next coefficient's
// red and ignored). The last coefficient is added apart: a fourth float behind it may not exist.
HWY_INLINE void Sum(const Basis& b, size_t j, int coefficients, const float* HWY_RESTRICT sh, float* HWY_RESTRICT rgb) {
  const int last = coefficients - 1;
#if HWY_TARGET == HWY_SCALAR
  rgb[0] = rgb[1] = rgb[2] = 0.0f;
  for (int k = 0; k < last; ++k) {
    for (int c = 0; c < 3; ++c) rgb[c] += b.value[k][j] * sh[3 * k + c];
  }
#else
  const hn::FixedTag<float, 4> d4;
  auto even = hn::Zero(d4), odd = hn::Zero(d4);  // two chains: an addition has a latency of several cycles
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

void EvaluateChunk(const SphericalHarmonicsParams& p, int64_t chunk) {
  Basis b;
  const size_t lanes = hn::Lanes(D());
  const int coefficients = ShCoefficients(p.degree);
  int32_t* visible = p.visible + chunk * kProjectChunk;
  const size_t count = static_cast<size_t>(p.visible_counts[chunk]);
  size_t kept = 0;
  for (size_t begin = 0; begin < count; begin += kBatch) {
    const size_t n = std::min(kBatch, count - begin);
    for (size_t j = 0; j < n; ++j) {
      const float* mean = p.means + 3 * int64_t{visible[begin + j]};
      // The difference in double: far from the world's origin floats have no digits left for it.
      for (size_t a = 0; a < 3; ++a) b.direction[a][j] = static_cast<float>(mean[a] - p.center[a]);
    }
    for (size_t j = n; j < (n + 15) / 16 * 16; ++j) {  // lanes that nobody reads
      for (size_t a = 0; a < 3; ++a) b.direction[a][j] = 1.0f;
    }
    for (size_t j = 0; j < n; j += lanes) EvaluateBasis(p.degree, j, b);
    for (size_t j = 0; j < n; ++j) {
      const int32_t i = visible[begin + j];
      float rgb[3];
      Sum(b, j, coefficients, p.sh + i * p.stride, rgb);
      bool finite = true;
      for (int c = 0; c < 3; ++c) {
        rgb[c] += 0.5f;
        finite = finite && std::abs(rgb[c]) <= std::numeric_limits<float>::max();  // false for NaN, too
      }
      if (!finite) {
        p.tiles[i] = TileRect{};
        continue;
      }
      for (int c = 0; c < 3; ++c) p.projected[i].rgb[c] = std::max(rgb[c], 0.0f);
      visible[kept++] = i;  // kept ≤ begin + j: never overtakes the reading
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
