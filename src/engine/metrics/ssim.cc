// Compiled once per instruction set; Highway picks one at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "metrics/ssim.cc"
#include "metrics/ssim.h"

#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "core/buffer.h"

HWY_BEFORE_NAMESPACE();
namespace anchorsplat::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// SSIM depends on the images only through local means of these five products.
enum Moment : size_t { kA, kB, kAA, kBB, kAB, kMoments };

// One row of each moment, filtered vertically but not yet horizontally: kSsimRadius zeros (padding), the row, and zeros
// up to a whole number of vectors past the right padding.
struct MomentRows {
  explicit MomentRows(int width)
      : stride(static_cast<size_t>(width) + 2 * kSsimRadius + 64), values(kMoments * stride) {
    std::fill(values.begin(), values.end(), 0.0f);
  }
  float* row(size_t moment) { return values.data() + moment * stride; }

  size_t stride;
  Buffer<float> values;
};

// All moments of columns [x, x + Lanes(d)) in row y.
template <class D>
void FilterColumns(D d, const SsimRows& rows, const float* weights, int y, int x, MomentRows& out) {
  auto a = hn::Zero(d), b = hn::Zero(d), aa = hn::Zero(d), bb = hn::Zero(d), ab = hn::Zero(d);
  const int from = y < kSsimRadius ? kSsimRadius - y : 0;
  const int to = y + kSsimRadius >= rows.height ? rows.height - y + kSsimRadius : kSsimTaps;
  for (int tap = from; tap < to; ++tap) {
    const size_t at =
        static_cast<size_t>(y + tap - kSsimRadius) * static_cast<size_t>(rows.width) + static_cast<size_t>(x);
    const auto weight = hn::Set(d, weights[tap]);
    const auto va = hn::LoadU(d, rows.a + at), vb = hn::LoadU(d, rows.b + at);
    const auto wa = hn::Mul(weight, va), wb = hn::Mul(weight, vb);
    a = hn::Add(a, wa);
    b = hn::Add(b, wb);
    aa = hn::MulAdd(wa, va, aa);
    bb = hn::MulAdd(wb, vb, bb);
    ab = hn::MulAdd(wa, vb, ab);
  }
  const size_t at = static_cast<size_t>(x + kSsimRadius);
  hn::StoreU(a, d, out.row(kA) + at);
  hn::StoreU(b, d, out.row(kB) + at);
  hn::StoreU(aa, d, out.row(kAA) + at);
  hn::StoreU(bb, d, out.row(kBB) + at);
  hn::StoreU(ab, d, out.row(kAB) + at);
}

template <class D>
HWY_INLINE hn::Vec<D> FilterRow(D d, const float* row, const float* weights) {
  auto sum = hn::Mul(hn::Set(d, weights[0]), hn::LoadU(d, row));
  for (int tap = 1; tap < kSsimTaps; ++tap) {
    sum = hn::MulAdd(hn::Set(d, weights[tap]), hn::LoadU(d, row + tap), sum);
  }
  return sum;
}

// 1 − SSIM from the five local means. Exactly 0 for equal images, hence no fused multiply-add.
template <class D>
HWY_INLINE hn::Vec<D> Dissimilarity(D d, hn::Vec<D> a, hn::Vec<D> b, hn::Vec<D> aa, hn::Vec<D> bb, hn::Vec<D> ab) {
  const auto c1 = hn::Set(d, kSsimC1), c2 = hn::Set(d, kSsimC2);
  const auto mean_aa = hn::Mul(a, a), mean_bb = hn::Mul(b, b), mean_ab = hn::Mul(a, b);
  const auto variances = hn::Add(hn::Sub(aa, mean_aa), hn::Sub(bb, mean_bb));
  const auto covariance = hn::Sub(ab, mean_ab);
  const auto numerator = hn::Mul(hn::Add(hn::Add(mean_ab, mean_ab), c1), hn::Add(hn::Add(covariance, covariance), c2));
  const auto denominator = hn::Mul(hn::Add(hn::Add(mean_aa, mean_bb), c1), hn::Add(variances, c2));
  return hn::Sub(hn::Set(d, 1.0f), hn::Div(numerator, denominator));
}

double SumOfDissimilarityImpl(const SsimRows& rows, const float* weights) {
  const hn::ScalableTag<float> d;
  const hn::CappedTag<float, 1> one;
  const int lanes = static_cast<int>(hn::Lanes(d));
  MomentRows moments(rows.width);
  Buffer<float> values(static_cast<size_t>(rows.width) + 64);
  double total = 0;
  for (int y = rows.first; y < rows.last; ++y) {
    int x = 0;
    for (; x + lanes <= rows.width; x += lanes) FilterColumns(d, rows, weights, y, x, moments);
    for (; x < rows.width; ++x) FilterColumns(one, rows, weights, y, x, moments);
    for (x = 0; x < rows.width; x += lanes) {
      const auto mean = [&](Moment m) { return FilterRow(d, moments.row(m) + x, weights); };
      const auto off = Dissimilarity(d, mean(kA), mean(kB), mean(kAA), mean(kBB), mean(kAB));
      hn::StoreU(off, d, values.data() + x);
    }
    if (rows.ignored != nullptr) {
      const uint8_t* ignored = rows.ignored + static_cast<size_t>(y) * static_cast<size_t>(rows.width);
      for (x = 0; x < rows.width; ++x) {
        if (ignored[x] != 0) values[static_cast<size_t>(x)] = 0;
      }
    }
    // Fixed lanes for any instruction set: eight float sums per row, then doubles.
    float sums[8] = {};
    for (x = 0; x + 8 <= rows.width; x += 8) {
      for (int k = 0; k < 8; ++k) sums[k] += values[static_cast<size_t>(x + k)];
    }
    for (; x < rows.width; ++x) sums[0] += values[static_cast<size_t>(x)];
    for (const float sum : sums) total += static_cast<double>(sum);
  }
  return total;
}

}  // namespace anchorsplat::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace anchorsplat {

HWY_EXPORT(SumOfDissimilarityImpl);

namespace {

std::array<float, kSsimTaps> Window() {
  std::array<double, kSsimTaps> window{};
  double sum = 0;
  for (int i = 0; i < kSsimTaps; ++i) {
    const double x = i - kSsimRadius;
    sum += window[static_cast<size_t>(i)] = std::exp(-x * x / (2 * kSsimSigma * kSsimSigma));
  }
  std::array<float, kSsimTaps> weights{};
  for (size_t i = 0; i < kSsimTaps; ++i) weights[i] = static_cast<float>(window[i] / sum);
  return weights;
}

}  // namespace

const std::array<float, kSsimTaps>& SsimWindow() {
  static const std::array<float, kSsimTaps> window = Window();
  return window;
}

double SumOfDissimilarity(const SsimRows& rows) {
  return HWY_DYNAMIC_DISPATCH(SumOfDissimilarityImpl)(rows, SsimWindow().data());
}

}  // namespace anchorsplat
#endif  // HWY_ONCE
