#include "kernels/serialization.h"

#include <algorithm>
#include <bit>
#include <numeric>
#include <random>
#include <utility>

#include "core/parallel.h"
#include "core/text.h"

namespace anchorsplat {

namespace {

// Spreads the bits of a 21-bit number to every third place.
uint64_t Spread(uint64_t v) {
  v &= 0x1fffff;
  v = (v | v << 32) & 0x001f00000000ffffull;
  v = (v | v << 16) & 0x001f0000ff0000ffull;
  v = (v | v << 8) & 0x100f00f00f00f00full;
  v = (v | v << 4) & 0x10c30c30c30c30c3ull;
  v = (v | v << 2) & 0x1249249249249249ull;
  return v;
}

uint64_t Interleave(uint32_t x, uint32_t y, uint32_t z) { return Spread(x) << 2 | Spread(y) << 1 | Spread(z); }

uint64_t Hilbert(int depth, std::array<uint32_t, 3> v) {
  for (int bit = depth - 1; bit >= 0; --bit) {
    const uint32_t low = (uint32_t{1} << bit) - 1;
    for (int axis = 0; axis < 3; ++axis) {
      if (v[static_cast<size_t>(axis)] >> bit & 1) {
        v[0] ^= low;
      } else {
        const uint32_t swapped = (v[0] ^ v[static_cast<size_t>(axis)]) & low;
        v[0] ^= swapped;
        v[static_cast<size_t>(axis)] ^= swapped;
      }
    }
  }
  // Gray decoding over the whole word, not per axis.
  uint64_t code = Interleave(v[0], v[1], v[2]);
  for (int shift = 1; shift < 64; shift *= 2) code ^= code >> shift;
  return code;
}

}  // namespace

int CurveDepth(int32_t largest_coordinate, DepthRule rule) {
  const uint32_t largest = static_cast<uint32_t>(std::max(0, largest_coordinate));
  return std::bit_width(rule == DepthRule::kLargest ? largest : largest + 1);
}

int64_t CurveCode(Curve curve, int depth, int32_t x, int32_t y, int32_t z) {
  uint32_t a = static_cast<uint32_t>(x), b = static_cast<uint32_t>(y);
  const uint32_t c = static_cast<uint32_t>(z);
  if (curve == Curve::kZTrans || curve == Curve::kHilbertTrans) std::swap(a, b);
  const bool z_order = curve == Curve::kZ || curve == Curve::kZTrans;
  return static_cast<int64_t>(z_order ? Interleave(a, b, c) : Hilbert(depth, {a, b, c}));
}

void CurveCodes(Curve curve, int depth, std::span<const int32_t> voxels, std::span<int64_t> codes) {
  ParallelFor(0, static_cast<int64_t>(codes.size()), 4096, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      const int32_t* v = voxels.data() + 3 * i;
      codes[static_cast<size_t>(i)] = CurveCode(curve, depth, v[0], v[1], v[2]);
    }
  });
}

Buffer<int32_t> OrderOfCodes(std::span<const int64_t> codes) {
  // LSD radix sort: stable, and codes have few bits (27 at a resolution of 384).
  constexpr int kDigitBits = 11;
  constexpr size_t kDigits = size_t{1} << kDigitBits;
  const size_t n = codes.size();
  Buffer<int32_t> order(n), next(n);
  std::iota(order.begin(), order.end(), 0);
  int64_t all_bits = 0;
  for (const int64_t code : codes) all_bits |= code;
  const int bits = std::bit_width(static_cast<uint64_t>(all_bits));
  for (int shift = 0; shift < bits; shift += kDigitBits) {
    std::array<size_t, kDigits + 1> start{};
    const auto digit = [&](size_t row) {
      return static_cast<size_t>(static_cast<uint64_t>(codes[row]) >> shift & (kDigits - 1));
    };
    for (size_t i = 0; i < n; ++i) ++start[digit(i) + 1];
    std::partial_sum(start.begin(), start.end(), start.begin());
    for (size_t i = 0; i < n; ++i) next[start[digit(static_cast<size_t>(order[i]))]++] = order[i];
    order.swap(next);
  }
  return order;
}

Status Validate(const Shuffles& shuffles) {
  for (size_t i = 0; i < shuffles.size(); ++i) {
    Shuffle sorted = shuffles[i];
    std::sort(sorted.begin(), sorted.end());
    if (sorted != kNoShuffle) {
      return Error{ErrorCode::kBadArgument,
                   Cat("shuffle ", i + 1, " of ", kShuffles, " is not a permutation of 0 1 2 3")};
    }
  }
  return {};
}

Shuffles ShufflesFromSeed(uint64_t seed) {
  // PyTorch's CPU generator is MT19937 seeded with the low 32 bits; randperm of few elements swaps element i with
  // element i + (random % (n − i)).
  std::mt19937 generator(static_cast<uint32_t>(seed));
  Shuffles shuffles = kNoShuffles;
  for (Shuffle& shuffle : shuffles) {
    for (size_t i = 0; i + 1 < shuffle.size(); ++i) {
      const size_t offset = static_cast<size_t>(generator()) % (shuffle.size() - i);
      std::swap(shuffle[i], shuffle[i + offset]);
    }
  }
  return shuffles;
}

}  // namespace anchorsplat
