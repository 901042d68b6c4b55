#include "render/spherical_harmonics_backward.h"

#include <hwy/cache_control.h>

#include <algorithm>
#include <cstddef>
#include <optional>

#include "core/gaussian_cloud.h"
#include "core/parallel.h"
#include "core/spherical_harmonics.h"
#include "render/adam_runs.h"
#include "render/project.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "render/spherical_harmonics_backward.cc"
// foreach_target compiles this file once per instruction set, so it must come first.
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#include "render/adam-inl.h"
#include "render/spherical_harmonics_basis-inl.h"
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace anchorsplat {
namespace HWY_NAMESPACE {
namespace {

constexpr ptrdiff_t kAhead = 24;  // prefetch distance in Gaussians: rows are large and not all are needed
constexpr int kFloatsPerLine = 16;
constexpr size_t kFloatsAtMost = 3 * kShCoefficientsAtMost;  // per row

// ∂Y_k/∂(x, y, z) at unit directions; terms that are 0 everywhere are omitted.
struct BasisSlopes {
  alignas(64) float slope[3][kShCoefficientsAtMost][kShBatch];
};

HWY_INLINE void EvaluateSlopes(int degree, size_t j, const ShBasisBatch& b, BasisSlopes& s) {
  if (degree < 1) return;
  const ShTag d;
  const ShVector x = hn::Load(d, b.direction[0] + j), y = hn::Load(d, b.direction[1] + j),
                 z = hn::Load(d, b.direction[2] + j);
  const auto c = [d](float value) HWY_ATTR { return hn::Set(d, value); };
  const auto times = [d](float f, ShVector a) HWY_ATTR { return hn::Mul(hn::Set(d, f), a); };
  const auto put_x = [&s, d, j](size_t k, ShVector slope) HWY_ATTR { hn::Store(slope, d, s.slope[0][k] + j); };
  const auto put_y = [&s, d, j](size_t k, ShVector slope) HWY_ATTR { hn::Store(slope, d, s.slope[1][k] + j); };
  const auto put_z = [&s, d, j](size_t k, ShVector slope) HWY_ATTR { hn::Store(slope, d, s.slope[2][k] + j); };
  put_y(1, c(-kSh1));
  put_z(2, c(kSh1));
  put_x(3, c(-kSh1));
  if (degree < 2) return;
  put_x(4, times(kSh2[0], y)), put_y(4, times(kSh2[0], x));
  put_y(5, times(-kSh2[0], z)), put_z(5, times(-kSh2[0], y));
  put_z(6, times(2 * kSh2[1], z));
  put_x(7, times(-kSh2[0], z)), put_z(7, times(-kSh2[0], x));
  put_x(8, times(2 * kSh2Diagonal, x)), put_y(8, times(-2 * kSh2Diagonal, y));
  if (degree < 3) return;
  const ShVector xx = hn::Mul(x, x), yy = hn::Mul(y, y), zz = hn::Mul(z, z), xy = hn::Mul(x, y), xz = hn::Mul(x, z),
                 yz = hn::Mul(y, z), difference = hn::Sub(xx, yy);
  const ShVector ring = hn::NegMulAdd(c(kSh3[3]), zz, c(kSh3[2]));
  put_x(9, times(-6 * kSh3[0], xy)), put_y(9, times(-3 * kSh3[0], difference));
  put_x(10, times(kSh3[1], yz)), put_y(10, times(kSh3[1], xz)), put_z(10, times(kSh3[1], xy));
  put_y(11, ring), put_z(11, times(-2 * kSh3[3], yz));
  put_z(12, hn::MulSub(c(3 * kSh3[4]), zz, c(kSh3[5])));
  put_x(13, ring), put_z(13, times(-2 * kSh3[3], xz));
  put_x(14, times(2 * kSh3[6], xz)), put_y(14, times(-2 * kSh3[6], yz)), put_z(14, times(kSh3[6], difference));
  put_x(15, times(-3 * kSh3[0], difference)), put_y(15, times(6 * kSh3[0], xy));
}

// sh_gradient[k] = Y_k·g for all coefficients.
HWY_INLINE void Spread(const ShBasisBatch& b, size_t j, int coefficients, const float* g, float* HWY_RESTRICT out) {
  const int last = coefficients - 1;
#if HWY_TARGET == HWY_SCALAR
  for (int k = 0; k < last; ++k) {
    for (int c = 0; c < 3; ++c) out[3 * k + c] = b.value[k][j] * g[c];
  }
#else
  // Four floats at a time; the next store overwrites the fourth.
  const hn::FixedTag<float, 4> d4;
  const auto g4 = hn::Load(d4, g);
  for (int k = 0; k < last; ++k) hn::StoreU(hn::Mul(hn::Set(d4, b.value[k][j]), g4), d4, out + 3 * k);
#endif
  for (int c = 0; c < 3; ++c) out[3 * last + c] = b.value[last][j] * g[c];
}

// Coefficients along the slopes, Σ_k ∇Y_k·sh[k], for x, y and z: each an unused number, then red, green and blue. Y_0
// has no slope, and most others none along one or two axes.
HWY_INLINE void AlongSlopes(const BasisSlopes& s, size_t j, int degree, const float* HWY_RESTRICT sh,
                            float* HWY_RESTRICT out) {
#if HWY_TARGET == HWY_SCALAR
  std::fill_n(out, 12, 0.0f);
  const auto add = [&](size_t axis, size_t k) {
    for (size_t c = 0; c < 3; ++c) out[4 * axis + 1 + c] += s.slope[axis][k][j] * sh[3 * k + c];
  };
  const auto one = [&](size_t k, size_t a) { add(a, k); };
#else
  // Reads from one float before the coefficient's red, so as not to read past the last coefficient.
  const hn::FixedTag<float, 4> d4;
  using V4 = hn::Vec<decltype(d4)>;
  V4 x = hn::Zero(d4), y = hn::Zero(d4), z = hn::Zero(d4);
  const auto add = [&](size_t axis, size_t k) HWY_ATTR {
    V4& sum = axis == 0 ? x : axis == 1 ? y : z;
    sum = hn::MulAdd(hn::Set(d4, s.slope[axis][k][j]), hn::LoadU(d4, sh + 3 * k - 1), sum);
  };
  const auto one = [&](size_t k, size_t a) HWY_ATTR { add(a, k); };
#endif
  const auto two = [&](size_t k, size_t a, size_t b) HWY_ATTR { add(a, k), add(b, k); };
  const auto all = [&](size_t k) HWY_ATTR { add(0, k), add(1, k), add(2, k); };
  one(1, 1), one(2, 2), one(3, 0);
  if (degree > 1) two(4, 0, 1), two(5, 1, 2), one(6, 2), two(7, 0, 2), two(8, 0, 1);
  if (degree > 2) two(9, 0, 1), all(10), two(11, 1, 2), one(12, 2), two(13, 0, 2), all(14), two(15, 0, 1);
#if HWY_TARGET != HWY_SCALAR
  hn::Store(x, d4, out);
  hn::Store(y, d4, out + 4);
  hn::Store(z, d4, out + 8);
#endif
}

// Gaussians of a batch with a gradient.
struct Taught {
  size_t count = 0;
  int64_t rows[kShBatch];
  alignas(64) float g[kShBatch][4];         // ∂L/∂rgb, 0
  alignas(64) float along[3][kShBatch][4];  // from AlongSlopes, by axis
  alignas(64) float means[3][kShBatch];     // ∂L/∂mean through the direction
};

// A register of Gaussians: ∂L/∂direction, then through the normalisation, which removes the component along the ray.
HWY_INLINE void DirectionLanes(const ShBasisBatch& b, size_t j, Taught& t) {
  const ShTag d;
  ShVector red, green, blue, unread;
  hn::LoadInterleaved4(d, t.g[j], red, green, blue, unread);
  const auto along = [&](size_t axis) HWY_ATTR {
    ShVector r, g, v;
    hn::LoadInterleaved4(d, t.along[axis][j], unread, r, g, v);
    return hn::MulAdd(r, red, hn::MulAdd(g, green, hn::Mul(v, blue)));
  };
  const ShVector along_x = along(0), along_y = along(1), along_z = along(2);
  const ShVector x = hn::Load(d, b.direction[0] + j), y = hn::Load(d, b.direction[1] + j),
                 z = hn::Load(d, b.direction[2] + j), inverse = hn::Load(d, b.inverse_distance + j);
  const ShVector radial = hn::MulAdd(along_x, x, hn::MulAdd(along_y, y, hn::Mul(along_z, z)));
  hn::Store(hn::Mul(inverse, hn::NegMulAdd(radial, x, along_x)), d, t.means[0] + j);
  hn::Store(hn::Mul(inverse, hn::NegMulAdd(radial, y, along_y)), d, t.means[1] + j);
  hn::Store(hn::Mul(inverse, hn::NegMulAdd(radial, z, along_z)), d, t.means[2] + j);
}

// Rows [first, last), at most a batch, of which [visible, end) are visible. `out`: gradient of row `first`.
void BackwardRows(const SphericalHarmonicsBackwardParams& p, int64_t first, int64_t last, const int32_t* visible,
                  const int32_t* end, float* out) {
  const size_t lanes = hn::Lanes(ShTag());
  const int coefficients = ShCoefficients(p.degree);
  Taught t;
  for (; visible != end; ++visible) {
    const int64_t i = *visible;
    const ProjectedGaussian& projected = p.projected[i];
    float* g = t.g[t.count];
    for (int c = 0; c < 3; ++c) g[c] = projected.rgb[c] > 0 ? p.gradients[i].rgb[c] : 0.0f;
    g[3] = 0;
    t.rows[t.count] = i;
    // Occluded Gaussians have no gradient, and there are many.
    t.count += !(g[0] == 0 && g[1] == 0 && g[2] == 0);
  }
  ShBasisBatch b;
  BasisSlopes s;
  if (t.count > 0) {
    LoadDirections(
        t.count, [&](size_t j) { return p.means + 3 * t.rows[j]; }, p.center, b);
  }
  for (size_t j = 0; j < t.count; j += lanes) {
    EvaluateBasis(p.degree, j, b);
    EvaluateSlopes(p.degree, j, b, s);
  }
  int64_t written = first;  // rows below are final
  const auto clear_to = [&](int64_t row) {
    std::fill(out + (written - first) * p.stride, out + (row - first) * p.stride, 0.0f);
  };
  for (size_t j = 0; j < t.count; ++j) {
    const int64_t i = t.rows[j];
    // In dense splats nearly all are needed; fetched one by one, they would wait for each other.
    if (const int64_t next = i + kAhead; next < p.count) {
      for (int k = 0; k < 3 * coefficients; k += kFloatsPerLine) hwy::Prefetch(p.sh + next * p.stride + k);
    }
    clear_to(i);
    written = i + 1;
    float* row = out + (i - first) * p.stride;
    Spread(b, j, coefficients, t.g[j], row);
    std::fill(row + 3 * coefficients, row + p.stride, 0.0f);
    if (p.degree < 1) continue;
    alignas(16) float along[12];
    AlongSlopes(s, j, p.degree, p.sh + i * p.stride, along);
    for (size_t a = 0; a < 3; ++a) std::copy_n(along + 4 * a, 4, t.along[a][j]);
  }
  clear_to(last);
  if (p.degree < 1) return;
  for (size_t j = 0; j < t.count; j += lanes) DirectionLanes(b, j, t);
  for (size_t j = 0; j < t.count; ++j) {
    float* mean = p.mean_gradients + 3 * t.rows[j];
    for (size_t a = 0; a < 3; ++a) mean[a] += t.means[a][j];
  }
}

// Applies a step to rows of coefficients in pieces.
struct Steps {
  Steps(const CoefficientStep& own_step, int64_t own_stride) : step(own_step), stride(own_stride) {
    runs.stride = stride;
    runs.period = AdamPeriod(step.columns);
    runs.rates = rates;
    runs.numbers = step.numbers;
    for (int64_t k = 0; k < runs.period; ++k) rates[k] = k % step.columns < 3 ? step.first_rate : step.rate;
  }
  Steps(const Steps&) = delete;
  Steps& operator=(const Steps&) = delete;

  const CoefficientStep& step;
  int64_t stride;
  AdamRuns runs{};
  alignas(64) float rates[kFloatsAtMost * kMaxAdamLanes];
};

// Rows [first, last), with their `gradient`.
void StepRows(Steps& s, int64_t first, int64_t last, const float* gradient) {
  const bool whole = s.step.columns == s.stride;  // all rows form one run
  s.runs.gradient = gradient;
  s.runs.runs = whole ? 1 : last - first;
  s.runs.count = whole ? (last - first) * s.stride : s.step.columns;
  s.runs.first_moment = s.step.first_moment + first * s.stride;
  s.runs.second_moment = s.step.second_moment + first * s.stride;
  s.runs.values = s.step.values + first * s.stride;
  UpdateAll(s.runs);
}

void StepRange(const CoefficientStep& step, int64_t stride, int64_t first, int64_t last, const float* gradient) {
  Steps steps(step, stride);
  StepRows(steps, first, last, gradient);
}

void BackwardChunk(const SphericalHarmonicsBackwardParams& p, int64_t chunk) {
  constexpr int64_t kRows = static_cast<int64_t>(kShBatch);
  const int64_t chunk_begin = chunk * kProjectChunk, chunk_end = std::min(chunk_begin + kProjectChunk, p.count);
  const int32_t* visible = p.visible + chunk_begin;
  const int32_t* end = visible + p.visible_counts[chunk];
  alignas(64) float gradients[kShBatch * kFloatsAtMost];
  std::optional<Steps> steps;
  if (p.step != nullptr) steps.emplace(*p.step, p.stride);
  for (int64_t first = chunk_begin; first < chunk_end; first += kRows) {
    const int64_t last = std::min(first + kRows, chunk_end);
    const int32_t* behind = visible;
    while (behind != end && *behind < last) ++behind;
    BackwardRows(p, first, last, visible, behind, p.step != nullptr ? gradients : p.sh_gradients + first * p.stride);
    visible = behind;
    if (steps) StepRows(*steps, first, last, gradients);
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace anchorsplat
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace anchorsplat {

HWY_EXPORT(BackwardChunk);
HWY_EXPORT(StepRange);

void SphericalHarmonicsBackwardCpu(const SphericalHarmonicsBackwardParams& p, int64_t chunk) {
  HWY_DYNAMIC_DISPATCH(BackwardChunk)(p, chunk);
}

void StepCoefficients(const CoefficientStep& step, int64_t stride, int64_t count, const float* gradient) {
  ParallelFor(0, count, kProjectChunk, [&](int64_t first, int64_t last) {
    HWY_DYNAMIC_DISPATCH(StepRange)(step, stride, first, last, gradient + first * stride);
  });
}

}  // namespace anchorsplat
#endif
