#include "formats/sog/scalar_codebook.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/parallel.h"

namespace anchorsplat {

namespace {

constexpr int kBins = 8192;
constexpr int kEntries = 256;
constexpr int64_t kCodebookGrain = 1 << 16;

struct Extremes {
  double min = std::numeric_limits<double>::infinity();
  double max = -std::numeric_limits<double>::infinity();
};

struct Bin {
  double count = 0, sum = 0;
};

// Prefix sums over non-empty bins, and the cost of merging a run of them.
struct Runs {
  std::vector<double> count, sum, squares;  // [bins + 1]

  explicit Runs(const std::vector<Bin>& bins) : count(1, 0.0), sum(1, 0.0), squares(1, 0.0) {
    for (const Bin& bin : bins) {
      count.push_back(count.back() + bin.count);
      sum.push_back(sum.back() + bin.sum);
      squares.push_back(squares.back() + bin.sum * bin.sum / bin.count);
    }
  }
  double Cost(int first, int last) const {  // of merging bins [first, last)
    const auto a = static_cast<size_t>(first), b = static_cast<size_t>(last);
    const double s = sum[b] - sum[a];
    return squares[b] - squares[a] - s * s / (count[b] - count[a]);
  }
  double Mean(int first, int last) const {
    const auto a = static_cast<size_t>(first), b = static_cast<size_t>(last);
    return (sum[b] - sum[a]) / (count[b] - count[a]);
  }
};

// Computes cost[m], that of the best clustering of the first m bins with one cluster more than in `before`, and
// begins[m], the start of its last cluster, for m in [low, high], given that begins[m] is within [first, last].
void SolveLayer(const Runs& runs, const std::vector<double>& before, int low, int high, int first, int last,
                std::vector<double>& cost, std::vector<uint16_t>& begins) {
  if (low > high) return;
  const int middle = (low + high) / 2;
  double best = std::numeric_limits<double>::infinity();
  int best_begin = first;
  for (int begin = first; begin <= std::min(last, middle - 1); ++begin) {
    const double candidate = before[static_cast<size_t>(begin)] + runs.Cost(begin, middle);
    if (candidate < best) {
      best = candidate;
      best_begin = begin;
    }
  }
  cost[static_cast<size_t>(middle)] = best;
  begins[static_cast<size_t>(middle)] = static_cast<uint16_t>(best_begin);
  SolveLayer(runs, before, low, middle - 1, first, best_begin, cost, begins);
  SolveLayer(runs, before, middle + 1, high, best_begin, last, cost, begins);
}

template <typename Part, typename Add>
std::vector<Part> Collect(int64_t rows, Add&& add) {
  std::vector<Part> parts(static_cast<size_t>((rows + kCodebookGrain - 1) / kCodebookGrain));
  ParallelFor(0, rows, kCodebookGrain, [&](int64_t first, int64_t last) {
    for (int64_t i = first; i < last; ++i) add(parts[static_cast<size_t>(first / kCodebookGrain)], i);
  });
  return parts;
}

// Binning of values. Outliers must not widen all bins: most cover the range of the middle 99.9 % (and as much again on
// both sides), the rest what lies beyond.
class BinEdges {
 public:
  BinEdges(const float* values, int64_t rows, int64_t width, int64_t stride) {
    std::vector<float> sample;
    const int64_t step = std::max<int64_t>(1, rows * width / kSample);
    for (int64_t at = 0; at < rows * width; at += step) {
      const float x = values[at / width * stride + at % width];
      if (std::isfinite(x)) sample.push_back(x);
    }
    if (sample.empty()) return;
    const auto quantile = [&sample](double q) {
      const auto at = sample.begin() + static_cast<int64_t>(q * static_cast<double>(sample.size() - 1));
      std::nth_element(sample.begin(), at, sample.end());
      return double{*at};
    };
    low_ = quantile(0.0005);
    high_ = quantile(0.9995);
    const double extent = high_ - low_;
    low_ -= extent;
    high_ += extent;
  }
  void Extend(double min, double max) {
    min_ = std::min(min, low_);
    max_ = std::max(max, high_);
  }
  size_t BinOf(double x) const {
    if (x < low_) return Part(x, min_, low_, 0, kOuter);
    if (x > high_) return Part(x, high_, max_, kBins - kOuter, kOuter);
    return Part(x, low_, high_, kOuter, kBins - 2 * kOuter);
  }

 private:
  static constexpr int64_t kSample = 1 << 16;
  static constexpr int kOuter = 512;

  static size_t Part(double x, double from, double to, int first, int count) {
    const double t = to > from ? (x - from) / (to - from) : 0;
    return static_cast<size_t>(first + std::clamp(static_cast<int>(t * count), 0, count - 1));
  }
  double low_ = 0, high_ = 0, min_ = 0, max_ = 0;
};

std::vector<Bin> Histogram(const float* values, int64_t rows, int64_t width, int64_t stride) {
  BinEdges edges(values, rows, width, stride);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  double min = kInfinity, max = -kInfinity;
  for (const auto& [low, high] : Collect<Extremes>(rows, [&](Extremes&some, int64_t i) {
         for (int64_t k = 0; k < width; ++k) {
           const double x = values[i * stride + k];
           if (!std::isfinite(x)) continue;
           some.min = std::min(some.min, x);
           some.max = std::max(some.max, x);
         }
       })) {
    min = std::min(min, low);
    max = std::max(max, high);
  }
  if (min > max) return {};
  edges.Extend(min, max);
  std::vector<Bin> bins(kBins);
  for (const std::vector<Bin>&part : Collect<std::vector<Bin>>(rows, [&](std::vector<Bin>&some, int64_t i) {
         some.resize(kBins);
         for (int64_t k = 0; k < width; ++k) {
           const double x = values[i * stride + k];
           if (!std::isfinite(x)) continue;
           Bin& bin = some[edges.BinOf(x)];
           ++bin.count;
           bin.sum += x;
         }
       })) {
    for (size_t b = 0; b < bins.size() && b < part.size(); ++b) {
      bins[b].count += part[b].count;
      bins[b].sum += part[b].sum;
    }
  }
  std::erase_if(bins, [](const Bin& bin) { return bin.count == 0; });
  return bins;
}

}  // namespace

uint8_t ScalarCodebook::IndexOf(float value) const {
  if (std::isnan(value)) return 0;
  const auto above = std::lower_bound(values.begin(), values.end(), value);
  if (above == values.begin()) return 0;
  if (above == values.end()) return static_cast<uint8_t>(values.size() - 1);
  const auto nearest = value - above[-1] < *above - value ? above - 1 : above;
  return static_cast<uint8_t>(nearest - values.begin());
}

ScalarCodebook BuildScalarCodebook(const float* values, int64_t rows, int64_t width, int64_t stride) {
  ScalarCodebook codebook;
  const std::vector<Bin> bins = Histogram(values, rows, width, stride);
  if (bins.empty()) return codebook;
  const int count = static_cast<int>(bins.size());
  const int entries = std::min(kEntries, count);
  const Runs runs(bins);
  std::vector<double> cost(static_cast<size_t>(count) + 1), next(cost.size());
  for (int m = 1; m <= count; ++m) cost[static_cast<size_t>(m)] = runs.Cost(0, m);
  std::vector<std::vector<uint16_t>> begins(static_cast<size_t>(entries), std::vector<uint16_t>(cost.size()));
  for (int j = 1; j < entries; ++j) {
    SolveLayer(runs, cost, j + 1, count, j, count - 1, next, begins[static_cast<size_t>(j)]);
    cost.swap(next);
  }
  int end = count;
  for (int j = entries - 1; j >= 0; --j) {
    const int begin = begins[static_cast<size_t>(j)][static_cast<size_t>(end)];
    codebook.values[static_cast<size_t>(j)] = static_cast<float>(runs.Mean(begin, end));
    end = begin;
  }
  for (size_t k = static_cast<size_t>(entries); k < codebook.values.size(); ++k) {
    codebook.values[k] = codebook.values[static_cast<size_t>(entries) - 1];
  }
  return codebook;
}

}  // namespace anchorsplat
