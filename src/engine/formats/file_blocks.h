#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "core/buffer.h"
#include "core/cloud_blocks.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "io/input_file.h"

namespace anchorsplat {

// Blocks of a file that is read anew each time. A format says how some neighbouring rows are had.
class FileBlocks : public CloudBlocks {
 public:
  // Errors: the one of the lowest row that has any.
  Status ForEach(const Look& look) override;

 protected:
  // What a thread keeps from block to block.
  struct Room {
    GaussianCloud rows;  // SH degree 0
    Buffer<uint8_t> bytes;
  };

  // Rows [first, last) of the splat, at most kCloudBlockRows, as reading gives them: to rows 0 and on of `room.rows`,
  // which has as many. finite[i] is 1 and to become 0 where a harmonic that depends on the direction is infinite or
  // NaN; empty after the first time. Called from several threads.
  virtual Status Fill(int64_t first, int64_t last, Room& room, std::span<uint8_t> finite) = 0;
  // All rows have been seen for the first time, and no error: what reading says at its end.
  virtual Status EndFirst() { return {}; }

  bool first_time() const { return !usable_known_; }
  void BeginPass();
  // Calls `look` with the blocks of rows [first, last); `first` is a multiple of kCloudBlockRows.
  Status Show(int64_t first, int64_t last, Room& room, const Look& look);
  Status EndPass();
};

// Rows that share a Room: work for a thread.
inline constexpr int64_t kRowsPerRoom = 4 * kCloudBlockRows;

// Whether one of `count` floats is infinite or NaN: its exponent is all ones, to which one more is added here so that
// the sign bit tells. `from` has any alignment.
inline bool HasNotFinite(const uint8_t* from, size_t count) {
  uint32_t carry = 0;
  for (size_t k = 0; k < count; ++k) {
    uint32_t bits;
    std::memcpy(&bits, from + k * sizeof bits, sizeof bits);
    carry |= (bits & 0x7fffffffu) + 0x00800000u;
  }
  return (carry >> 31) != 0;
}

// Calls unpack(bytes, count, to) for records [first, last) of a file, which begin at byte `begin`: `count` records are
// rows `to` of the block and on. They stay in the L2 cache with what becomes of them; large records take no more memory
// than small ones.
template <typename Unpack>
Status ReadRows(const InputFile& file, uint64_t begin, size_t record, int64_t first, int64_t last,
                Buffer<uint8_t>& bytes, Unpack&& unpack) {
  constexpr size_t kReadAtOnce = size_t{128} << 10;
  const auto at_once = static_cast<int64_t>(std::max<size_t>(1, kReadAtOnce / record));
  bytes.resize(static_cast<size_t>(std::min(at_once, last - first)) * record);
  for (int64_t i = first; i < last; i += at_once) {
    const int64_t count = std::min(at_once, last - i);
    ANCHORSPLAT_RETURN_IF_ERROR(
        file.ReadAt(begin + static_cast<uint64_t>(i) * record, bytes.data(), static_cast<size_t>(count) * record));
    unpack(static_cast<const uint8_t*>(bytes.data()), count, i - first);
  }
  return {};
}

}  // namespace anchorsplat
