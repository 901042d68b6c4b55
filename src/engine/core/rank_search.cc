#include "core/rank_search.h"

#include <algorithm>
#include <bit>
#include <limits>

namespace anchorsplat {

namespace {
constexpr uint32_t kSign = uint32_t{1} << 31;
constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
}  // namespace

uint32_t RankSearch::KeyOf(float value) {
  const auto bits = std::bit_cast<uint32_t>(value);
  return (bits & kSign) != 0 ? ~bits : bits | kSign;
}

float RankSearch::ValueOf(uint32_t key) { return std::bit_cast<float>((key & kSign) != 0 ? key & ~kSign : ~key); }

RankSearch::RankSearch(std::span<const double> quantiles)
    : quantiles_(quantiles.begin(), quantiles.end()), coarse_(kCoarse), fine_of_(kCoarse) {}

void RankSearch::Count(std::span<const uint32_t> counts) {
  for (size_t bin = 0; bin < kCoarse; ++bin) {
    coarse_[bin] += counts[bin];
    total_ += counts[bin];
  }
}

void RankSearch::EndCounting() {
  if (total_ == 0) return;
  for (const double quantile : quantiles_) {
    const double at = std::clamp(quantile, 0.0, 1.0) * static_cast<double>(total_ - 1);
    const auto below = static_cast<uint64_t>(at);
    const double fraction = at - static_cast<double>(below);
    pairs_.push_back({Find(below), Find(fraction > 0 ? below + 1 : below), fraction});
  }
  for (const Pair& pair : pairs_) {
    for (const uint32_t bin : {pair.low.bin, pair.high.bin}) {
      if (fine_of_[bin] != 0) continue;
      fine_.push_back(std::make_unique<std::atomic<uint32_t>[]>(kFine));
      fine_of_[bin] = static_cast<uint8_t>(fine_.size());
    }
  }
}

RankSearch::Rank RankSearch::Find(uint64_t rank) const {
  for (size_t bin = 0; bin < kCoarse; ++bin) {
    if (rank < coarse_[bin]) return {rank, static_cast<uint32_t>(bin)};
    rank -= coarse_[bin];
  }
  return {};
}

void RankSearch::Refine(std::span<const float> values) {
  // Runs of equal numbers are added at once, as threads would contend for their counter.
  std::atomic<uint32_t>* at = nullptr;
  uint32_t times = 0;
  for (const float value : values) {
    const uint32_t key = KeyOf(value);
    const uint8_t fine = fine_of_[key >> kFineBits];
    if (fine == 0) continue;
    std::atomic<uint32_t>* const here = &fine_[fine - size_t{1}][key & (kFine - 1)];
    if (here != at) {
      if (times > 0) at->fetch_add(times, std::memory_order_relaxed);
      at = here;
      times = 0;
    }
    ++times;
  }
  if (times > 0) at->fetch_add(times, std::memory_order_relaxed);
}

float RankSearch::ValueAt(const Rank& rank) const {
  const std::atomic<uint32_t>* const fine = fine_[fine_of_[rank.bin] - size_t{1}].get();
  uint64_t left = rank.within;
  for (uint32_t k = 0; k < kFine; ++k) {
    const uint32_t here = fine[k].load(std::memory_order_relaxed);
    if (left < here) return ValueOf((rank.bin << kFineBits) | k);
    left -= here;
  }
  return kNone;
}

float RankSearch::LowerBound(size_t k) const {
  return pairs_.empty() ? kNone : ValueOf(pairs_[k].low.bin << kFineBits);
}

float RankSearch::UpperBound(size_t k) const {
  return pairs_.empty() ? kNone : ValueOf((pairs_[k].high.bin << kFineBits) | (kFine - 1));
}

RankSearch::Place RankSearch::At(size_t k) const {
  if (pairs_.empty()) return {kNone, kNone, 0};
  const Pair& pair = pairs_[k];
  return {ValueAt(pair.low), ValueAt(pair.high), pair.fraction};
}

}  // namespace anchorsplat
