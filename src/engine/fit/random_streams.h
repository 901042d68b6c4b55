#pragma once

#include <cstdint>

#include "core/random.h"

namespace anchorsplat {

// Purposes of random numbers. Each purpose and index (a step, an epoch) has its own stream, derived from the seed
// alone: a resumed fit draws the same numbers without storing a generator's state.
enum class RandomPurpose : uint64_t {
  kInitialQuats = 1,
  kInitialPoints = 2,
  kViewOrder = 3,
  kSplit = 4,
  kCopies = 5,
  kPoses = 6,
  kCrop = 7,
  kRelocation = 8,
  kNoise = 9,
};

inline Random RandomStream(uint64_t seed, RandomPurpose purpose, int64_t index = 0) {
  const uint64_t stream = (static_cast<uint64_t>(purpose) << 56) ^ static_cast<uint64_t>(index);
  return Random(Random(seed).Next() ^ Random(~stream).Next());
}

}  // namespace anchorsplat
