#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace anchorsplat {

// Quantiles of numbers of which there are too many to keep: exact, from counts. They are counted coarsely, then those
// near the quantiles finely; memory depends on the number of quantiles alone.
class RankSearch {
 public:
  // `quantiles`: fractions, as in Quantile (core/statistics.h).
  explicit RankSearch(std::span<const double> quantiles);

  // First, all numbers, by who counts them. No NaN.
  static constexpr size_t kCoarse = size_t{1} << 15;
  static size_t CoarseOf(float value) { return KeyOf(value) >> kFineBits; }
  void Count(std::span<const uint32_t> counts);  // [kCoarse] of some of them; not from several threads at once
  void EndCounting();

  // Then they are shown once more. From several threads.
  void Refine(std::span<const float> values);

  // Between these two quantile k lies for sure. After EndCounting; of no numbers: NaN.
  float LeastOf(size_t k) const;
  float MostOf(size_t k) const;

  // Quantile k is linear between the numbers of two neighbouring ranks, `low` + `fraction` · (`high` − `low`). After
  // Refine; of no numbers: NaN.
  struct Place {
    float low, high;
    double fraction;
  };
  Place At(size_t k) const;

 private:
  static constexpr uint32_t kFineBits = 17;
  static constexpr size_t kFine = size_t{1} << kFineBits;
  // Numbers as integers in the same order; −0 goes before 0.
  static uint32_t KeyOf(float value);
  static float ValueOf(uint32_t key);

  struct Rank {
    uint64_t within = 0;  // numbers in the same coarse bin before it
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
