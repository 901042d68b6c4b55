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

// Blocks that are read from the file in every pass. Formats implement Fill.
class FileBlocks : public CloudBlocks {
 public:
  // Errors: that of the lowest failing row.
  Status ForEach(const Visitor& visit) override;

 protected:
  // A thread's buffers, reused between blocks.
  struct Scratch {
    GaussianCloud rows;  // SH degree 0
    Buffer<uint8_t> bytes;
  };

  // Reads rows [first, last), at most kCloudBlockRows, into scratch.rows from row 0 on, which has room for them. In
  // the first pass sets finite[i], initially 1, to 0 if an SH coefficient of degree ≥ 1 is not finite; `finite` is
  // empty in later passes. Thread-safe.
  virtual Status Fill(int64_t first, int64_t last, Scratch& scratch, std::span<uint8_t> finite) = 0;
  // Called after the first pass without errors; reports what the reader reports at its end.
  virtual Status EndFirstPass() { return {}; }

  bool first_time() const { return !usable_known_; }
  void BeginPass();
  // Visits the blocks of rows [first, last); `first` is a multiple of kCloudBlockRows.
  Status VisitRows(int64_t first, int64_t last, Scratch& scratch, const Visitor& visit);
  Status EndPass();
};

// Rows per task, which share a Scratch.
inline constexpr int64_t kRowsPerScratch = 4 * kCloudBlockRows;

// Whether any of `count` floats at `from` (any alignment) is infinite or NaN: an exponent of all ones overflows into
// the sign bit when one is added.
inline bool HasNonFinite(const uint8_t* from, size_t count) {
  uint32_t carry = 0;
  for (size_t k = 0; k < count; ++k) {
    uint32_t bits;
    std::memcpy(&bits, from + k * sizeof bits, sizeof bits);
    carry |= (bits & 0x7fffffffu) + 0x00800000u;
  }
  return (carry >> 31) != 0;
}

// Reads records [first, last), which start at byte `begin` of the file, and calls unpack(bytes, count, to) for pieces:
// `count` records for rows of the block from `to` on. Pieces fit in the L2 cache with their results, and memory does
// not grow with the record size.
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
