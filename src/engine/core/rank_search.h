#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace anchorsplat {

// Exact quantiles of more numbers than fit in memory, in two passes: counts in coarse bins, then in fine bins near the
// quantiles. Memory depends only on the number of quantiles.
class RankSearch {
 public:
  // `quantiles`: fractions, as in Quantile (core/statistics.h).
  explicit RankSearch(std::span<const double> quantiles);

  // Pass 1: the caller counts all numbers (no NaN) by bin CoarseBin(value) and adds the counts. Not thread-safe.
  static constexpr size_t kCoarse = size_t{1} << 15;
  static size_t CoarseBin(float value) { return KeyOf(value) >> kFineBits; }
  void Count(std::span<const uint32_t> counts);  // [kCoarse]
  void EndCounting();

  // Pass 2, after EndCounting: all numbers again. Thread-safe.
  void Refine(std::span<const float> values);

  // Bounds of quantile k, available after EndCounting; NaN if there are no numbers.
  float LowerBound(size_t k) const;
  float UpperBound(size_t k) const;

  // Quantile k is `low` + `fraction` · (`high` − `low`), between the numbers of two neighbouring ranks. Available after
  // pass 2; NaN if there are no numbers.
  struct Place {
    float low, high;
    double fraction;
  };
  Place At(size_t k) const;

 private:
  static constexpr uint32_t kFineBits = 17;
  static constexpr size_t kFine = size_t{1} << kFineBits;
  // Maps floats to integers of the same order; −0 comes before 0.
  static uint32_t KeyOf(float value);
  static float ValueOf(uint32_t key);

  struct Rank {
    uint64_t within = 0;  // index within its coarse bin
    uint32_t bin = 0;
  };
  Rank Find(uint64_t rank) const;
  float ValueAt(const Rank& rank) const;

  std::vector<double> quantiles_;
  std::vector<uint64_t> coarse_;
  uint64_t total_ = 0;
  struct Pair {
    Rank low, high;
    double fraction = 0;
  };
  std::vector<Pair> pairs_;
  std::vector<uint8_t> fine_of_;  // [kCoarse] 1 + index in fine_; 0: none
  std::vector<std::unique_ptr<std::atomic<uint32_t>[]>> fine_;
};

}  // namespace anchorsplat
