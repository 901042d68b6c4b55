#include "kernels/voxel_neighbours.h"

#include <algorithm>
#include <bit>
#include <limits>

#include "core/parallel.h"

namespace anchorsplat {

namespace {

constexpr uint64_t kEmpty = std::numeric_limits<uint64_t>::max();

// Shifted by one, so that an offset of −1 stays non-negative and is simply not found.
uint64_t Key(int32_t x, int32_t y, int32_t z) {
  return static_cast<uint64_t>(x + 1) << 42 | static_cast<uint64_t>(y + 1) << 21 | static_cast<uint64_t>(z + 1);
}

// Hash map (open addressing) from voxel to its winner.
class VoxelMap {
 public:
  explicit VoxelMap(std::span<const int32_t> voxels) {
    const size_t points = voxels.size() / 3;
    const size_t slots = std::bit_ceil(std::max<size_t>(16, points * 2));
    mask_ = slots - 1;
    keys_.assign(slots, kEmpty);
    winners_.resize(slots);
    for (size_t i = 0; i < points; ++i) {
      const uint64_t key = Key(voxels[3 * i], voxels[3 * i + 1], voxels[3 * i + 2]);
      size_t slot = Slot(key);
      while (keys_[slot] != kEmpty && keys_[slot] != key) slot = (slot + 1) & mask_;
      keys_[slot] = key;
      winners_[slot] = static_cast<int32_t>(i);  // rows ascend, so the largest stays
    }
  }

  int32_t Find(uint64_t key) const {
    for (size_t slot = Slot(key); keys_[slot] != kEmpty; slot = (slot + 1) & mask_) {
      if (keys_[slot] == key) return winners_[slot];
    }
    return kNoNeighbour;
  }

 private:
  size_t Slot(uint64_t key) const {
    key *= 0x9e3779b97f4a7c15ull;
    return static_cast<size_t>(key ^ key >> 32) & mask_;
  }

  size_t mask_ = 0;
  Buffer<uint64_t> keys_;
  Buffer<int32_t> winners_;
};

}  // namespace

Buffer<int32_t> VoxelNeighbours(std::span<const int32_t> voxels) {
  const VoxelMap map(voxels);
  Buffer<int32_t> table(voxels.size() / 3 * kNeighbours);
  ParallelFor(0, static_cast<int64_t>(voxels.size() / 3), 1024, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      const int32_t* v = voxels.data() + 3 * i;
      int32_t* row = table.data() + kNeighbours * i;
      const bool winner = map.Find(Key(v[0], v[1], v[2])) == i;
      for (int k = 0; k < kNeighbours; ++k) {
        if (k == kCentre) {
          row[k] = static_cast<int32_t>(i);
        } else if (k > kCentre && !winner) {
          row[k] = kNoNeighbour;
        } else {
          row[k] = map.Find(Key(v[0] + k / 9 - 1, v[1] + k / 3 % 3 - 1, v[2] + k % 3 - 1));
        }
      }
    }
  });
  return table;
}

}  // namespace anchorsplat
