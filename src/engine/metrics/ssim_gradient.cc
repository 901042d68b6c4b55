// Compiled once per instruction set; Highway picks one at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "metrics/ssim_gradient.cc"
#include "metrics/ssim_gradient.h"

#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

#include <algorithm>
#include <cstddef>
#include <cstring>

#include "metrics/ssim.h"

HWY_BEFORE_NAMESPACE();
namespace anchorsplat::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using Tag = hn::CappedTag<float, 16>;
using Vector = hn::Vec<Tag>;

constexpr int kTaps = kSsimTaps;
constexpr int kSlack = 16;  // a register that starts within a row may end past it
// Columns of the three row types, in whole registers; column 0 of each is that of the previous type plus the radius.
constexpr int kHalo = 32;
static_assert(kHalo % kSlack == 0 && kHalo >= 2 * kSsimRadius + kSlack);
constexpr int kGradientColumns = kSsimStrip + kSlack;
constexpr int kMapColumns = kGradientColumns + kHalo;
constexpr int kPixelColumns = kMapColumns + kHalo;

enum Moment : size_t { kA, kD, kDD, kAB, kMoments };
enum Map : size_t { kP, kQ, kR, kMaps };

// Sliding-window state: a window of eleven rows moves down over the images' moments, filtered along rows, followed by
// another over the maps.
struct Rows {
  alignas(64) float pixels[kMoments][kPixelColumns];
  alignas(64) float moments[kMoments][kTaps][kMapColumns];  // row y at index y mod kTaps
  alignas(64) float maps[kMaps][kMapColumns];
  alignas(64) float filtered[kMaps][kTaps][kGradientColumns];
};

// Index of row y, which may be slightly negative.
size_t Place(int y) { return static_cast<size_t>((y + 16 * kTaps) % kTaps); }

// Filters along a row that starts at a multiple of the register length. The window is symmetric.
HWY_INLINE Vector FilterAlong(const float* row, const float* weights) {
  const Tag d;
#if HWY_TARGET == HWY_SCALAR
  const auto at = [row](int k) { return hn::LoadU(Tag(), row + k); };
  const Vector t0 = at(0), t1 = at(1), t2 = at(2), t3 = at(3), t4 = at(4), t5 = at(5), t6 = at(6), t7 = at(7),
               t8 = at(8), t9 = at(9), t10 = at(10);
#else
  // Nearly every unaligned load touches two cache lines, so there are four instead of eleven: the others are combined
  // from two that are four numbers apart.
  const Vector t0 = hn::Load(d, row), t4 = hn::LoadU(d, row + 4), t8 = hn::LoadU(d, row + 8),
               t12 = hn::LoadU(d, row + 12);
  const Vector t1 = hn::CombineShiftRightLanes<1>(d, t4, t0), t2 = hn::CombineShiftRightLanes<2>(d, t4, t0),
               t3 = hn::CombineShiftRightLanes<3>(d, t4, t0), t5 = hn::CombineShiftRightLanes<1>(d, t8, t4),
               t6 = hn::CombineShiftRightLanes<2>(d, t8, t4), t7 = hn::CombineShiftRightLanes<3>(d, t8, t4),
               t9 = hn::CombineShiftRightLanes<1>(d, t12, t8), t10 = hn::CombineShiftRightLanes<2>(d, t12, t8);
#endif
  static_assert(kTaps == 11);
  Vector sum = hn::Mul(hn::Set(d, weights[5]), t5);
  sum = hn::MulAdd(hn::Set(d, weights[0]), hn::Add(t0, t10), sum);
  sum = hn::MulAdd(hn::Set(d, weights[1]), hn::Add(t1, t9), sum);
  sum = hn::MulAdd(hn::Set(d, weights[2]), hn::Add(t2, t8), sum);
  sum = hn::MulAdd(hn::Set(d, weights[3]), hn::Add(t3, t7), sum);
  return hn::MulAdd(hn::Set(d, weights[4]), hn::Add(t4, t6), sum);
}

// Filters down columns, centred on row y.
template <int kColumns>
HWY_INLINE Vector FilterDown(const float (*rows)[kColumns], const size_t* places, int column, const float* weights) {
  const Tag d;
  Vector sum = hn::Mul(hn::Set(d, weights[kSsimRadius]), hn::Load(d, rows[places[kSsimRadius]] + column));
  for (int k = 0; k < kSsimRadius; ++k) {
    const Vector pair =
        hn::Add(hn::Load(d, rows[places[k]] + column), hn::Load(d, rows[places[kTaps - 1 - k]] + column));
    sum = hn::MulAdd(hn::Set(d, weights[k]), pair, sum);
  }
  return sum;
}

struct Places {
  explicit Places(int centre) {
    for (int k = 0; k < kTaps; ++k) at[k] = Place(centre + k - kSsimRadius);
  }
  size_t at[kTaps];
};

// Row y of the images' moments.
void AddPixelRow(const SsimGradientTask& t, const float* weights, int y, Rows& r) {
  const Tag d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const size_t place = Place(y);
  const int columns = t.out.x1 - t.out.x0 + 2 * kSsimRadius;  // of the maps
  if (y < 0 || y >= t.height) {
    for (auto& moment : r.moments) std::fill_n(moment[place], columns + lanes, 0.0f);
    return;
  }
  const int left = t.out.x0 - 2 * kSsimRadius;  // image column of column 0
  const int begin = std::max(0, left), end = std::min(t.width, t.out.x1 + 2 * kSsimRadius);
  const float* a = t.a + int64_t{y} * t.width;
  const float* b = t.b + int64_t{y} * t.width;
  for (auto& pixels : r.pixels) {
    std::fill_n(pixels, begin - left, 0.0f);
    std::fill(pixels + (end - left), pixels + kPixelColumns, 0.0f);
  }
  for (int x = begin; x < end; ++x) {
    const float difference = a[x] - b[x];
    r.pixels[kA][x - left] = a[x];
    r.pixels[kD][x - left] = difference;
    r.pixels[kDD][x - left] = difference * difference;
    r.pixels[kAB][x - left] = a[x] * b[x];
  }
  for (int column = 0; column < columns; column += lanes) {
    for (size_t m = 0; m < kMoments; ++m) {
      hn::Store(FilterAlong(r.pixels[m] + column, weights), d, r.moments[m][place] + column);
    }
  }
}

// Maps of row y from the moments of the eleven rows around it. Returns Σ (1 − SSIM) within `out`.
double AddMapRow(const SsimGradientTask& t, const float* weights, int y, Rows& r) {
  const Tag d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const size_t place = Place(y);
  const int columns = t.out.x1 - t.out.x0;  // of the gradient
  const int left = t.out.x0 - kSsimRadius;  // image column of column 0
  const int begin = std::max(0, t.map.x0 - left), end = std::min(columns + 2 * kSsimRadius, t.map.x1 - left);
  if (y < t.map.y0 || y >= t.map.y1 || begin >= end) {
    for (auto& filtered : r.filtered) std::fill_n(filtered[place], columns + lanes, 0.0f);
    return 0;
  }
  const Places places(y);
  const Vector c1 = hn::Set(d, kSsimC1), c2 = hn::Set(d, kSsimC2), one = hn::Set(d, 1.0f), two = hn::Set(d, 2.0f);
  const Vector counted_from = hn::Set(d, static_cast<float>(std::max(begin, kSsimRadius)));
  const Vector counted_to = hn::Set(d, static_cast<float>(std::min(end, columns + kSsimRadius)));
  Vector sum = hn::Zero(d);
  for (int column = begin / lanes * lanes; column < end; column += lanes) {
    const Vector a = FilterDown(r.moments[kA], places.at, column, weights);
    const Vector delta = FilterDown(r.moments[kD], places.at, column, weights);
    const Vector dd = FilterDown(r.moments[kDD], places.at, column, weights);
    const Vector ab = FilterDown(r.moments[kAB], places.at, column, weights);
    const Vector b = hn::Sub(a, delta), mean_ab = hn::Mul(a, b), delta2 = hn::Mul(delta, delta);
    const Vector n1 = hn::MulAdd(two, mean_ab, c1), e1 = hn::Add(n1, delta2);
    const Vector variance = hn::Sub(dd, delta2);
    const Vector n2 = hn::MulAdd(two, hn::Sub(ab, mean_ab), c2), e2 = hn::Add(n2, variance);
    const Vector inverse_e1 = hn::Div(one, e1), inverse_e2 = hn::Div(one, e2);
    const Vector similarity1 = hn::Mul(n1, inverse_e1), similarity2 = hn::Mul(n2, inverse_e2);
    // 1 − SSIM = 1 − (1 − δ²/e₁)(1 − var(d)/e₂): exactly 0 for equal images.
    const Vector off1 = hn::Mul(delta2, inverse_e1), off2 = hn::Mul(variance, inverse_e2);
    const Vector off = hn::NegMulAdd(off1, off2, hn::Add(off1, off2));
    const Vector q = hn::Neg(hn::Mul(hn::Mul(similarity1, similarity2), inverse_e2));
    const Vector rest = hn::Mul(two, hn::Mul(hn::Mul(similarity1, off2), inverse_e2));  // R
    // ∂SSIM/∂μ_a with variance and covariance held = 2 n₂/(e₁e₂)·(μ_b − μ_a·n₁/e₁), and μ_b − μ_a·n₁/e₁ = μ_a·δ²/e₁ −
    // δ.
    const Vector through_mean = hn::Mul(hn::Mul(two, hn::Mul(similarity2, inverse_e1)), hn::MulSub(a, off1, delta));
    const Vector p = hn::NegMulAdd(b, rest, hn::NegMulAdd(hn::Mul(two, q), delta, through_mean));
    hn::Store(p, d, r.maps[kP] + column);
    hn::Store(q, d, r.maps[kQ] + column);
    hn::Store(rest, d, r.maps[kR] + column);
    const Vector at =
        hn::Add(hn::Set(d, static_cast<float>(column)), hn::ConvertTo(d, hn::Iota(hn::RebindToSigned<Tag>(), 0)));
    const auto counted = hn::And(hn::Ge(at, counted_from), hn::Lt(at, counted_to));
    sum = hn::Add(sum, hn::IfThenElseZero(counted, off));
  }
  for (auto& map : r.maps) {
    std::fill_n(map, begin, 0.0f);
    std::fill(map + end, map + kMapColumns, 0.0f);
  }
  for (int column = 0; column < columns; column += lanes) {
    for (size_t m = 0; m < kMaps; ++m) {
      hn::Store(FilterAlong(r.maps[m] + column, weights), d, r.filtered[m][place] + column);
    }
  }
  return static_cast<double>(hn::GetLane(hn::SumOfLanes(d, sum)));
}

// Gradient row y from the maps of the eleven rows around it. Returns Σ |a − b|.
double WriteGradientRow(const SsimGradientTask& t, const float* weights, int y, const Rows& r) {
  const Tag d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const Places places(y);
  const int columns = t.out.x1 - t.out.x0;
  const int64_t start = int64_t{y} * t.width + t.out.x0;
  const float *a_row = t.a + start, *b_row = t.b + start;
  float* out = t.gradient + start;
  const Vector ssim_weight = hn::Set(d, t.ssim_weight), difference_weight = hn::Set(d, t.difference_weight);
  Vector sum = hn::Zero(d);
  alignas(64) float last[3][kSlack] = {};  // for the register that would reach past the row
  for (int column = 0; column < columns; column += lanes) {
    const bool whole = column + lanes <= columns;
    const size_t rest = static_cast<size_t>(columns - column) * sizeof(float);
    const float *a_from = a_row + column, *b_from = b_row + column;
    if (!whole) {
      std::memcpy(last[0], a_from, rest);
      std::memcpy(last[1], b_from, rest);
      a_from = last[0], b_from = last[1];
    }
    const Vector b = hn::LoadU(d, b_from), difference = hn::Sub(hn::LoadU(d, a_from), b);
    const Vector p = FilterDown(r.filtered[kP], places.at, column, weights);
    const Vector q = FilterDown(r.filtered[kQ], places.at, column, weights);
    const Vector r2 = FilterDown(r.filtered[kR], places.at, column, weights);
    const Vector ssim = hn::MulAdd(b, r2, hn::MulAdd(hn::Add(difference, difference), q, p));
    const Vector sign =
        hn::IfThenZeroElse(hn::Eq(difference, hn::Zero(d)), hn::CopySign(difference_weight, difference));
    const Vector gradient = hn::MulAdd(ssim_weight, ssim, sign);
    sum = hn::Add(sum, hn::Abs(difference));
    hn::StoreU(gradient, d, whole ? out + column : last[2]);
    if (!whole) std::memcpy(out + column, last[2], rest);
  }
  return static_cast<double>(hn::GetLane(hn::SumOfLanes(d, sum)));
}

SsimGradientSums SsimGradientImpl(const SsimGradientTask& t, const float* weights) {
  Rows r;
  SsimGradientSums sums;
  // Three fronts, each five rows after the previous one.
  for (int y = t.out.y0 - 2 * kSsimRadius; y < t.out.y1 + 2 * kSsimRadius; ++y) {
    AddPixelRow(t, weights, y, r);
    const int map_y = y - kSsimRadius;
    if (map_y < t.out.y0 - kSsimRadius) continue;
    const double dissimilarity = AddMapRow(t, weights, map_y, r);
    if (map_y >= t.out.y0 && map_y < t.out.y1) sums.dissimilarity += dissimilarity;
    const int out_y = map_y - kSsimRadius;
    if (out_y >= t.out.y0) sums.difference += WriteGradientRow(t, weights, out_y, r);
  }
  return sums;
}

}  // namespace anchorsplat::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace anchorsplat {

HWY_EXPORT(SsimGradientImpl);

SsimGradientSums SsimGradient(const SsimGradientTask& task) {
  return HWY_DYNAMIC_DISPATCH(SsimGradientImpl)(task, SsimWindow().data());
}

}  // namespace anchorsplat
#endif  // HWY_ONCE
