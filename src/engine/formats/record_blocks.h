#pragma once

#include <algorithm>
#include <cstdint>
#include <mutex>

#include "core/buffer.h"
#include "core/parallel.h"
#include "core/result.h"
#include "io/atomic_file.h"
#include "io/input_file.h"

namespace anchorsplat {

// Parallel access to consecutive fixed-size records of a file in blocks that stay in the L2 cache between the system
// call and (un)packing.

namespace internal {
inline constexpr size_t kRecordBlock = size_t{256} << 10;  // bytes
inline constexpr int64_t kBlocksPerTask = 8;               // sharing one buffer

// Calls block(first, last, buffer) until one fails; returns the failure that occurred first.
template <typename Block>
Status ForRecordBlocks(int64_t count, size_t record_size, Block&& block) {
  const auto records = static_cast<int64_t>(std::max<size_t>(1, kRecordBlock / record_size));
  std::mutex mutex;
  Status failure;
  ParallelFor(0, count, kBlocksPerTask * records, [&](int64_t first, int64_t last) {
    Buffer<uint8_t> buffer(static_cast<size_t>(std::min(records, last - first)) * record_size);
    for (int64_t i = first; i < last; i += records) {
      const Status status = block(i, std::min(last, i + records), buffer.data());
      if (status.ok()) continue;
      const std::lock_guard lock(mutex);
      if (failure.ok()) failure = status;
      return;
    }
  });
  return failure;
}
}  // namespace internal

// Calls unpack(first, last, bytes) for ranges that cover records [0, count), which start at byte `begin`.
template <typename Unpack>
Status ReadRecords(const InputFile& file, uint64_t begin, int64_t count, size_t record_size, Unpack&& unpack) {
  return internal::ForRecordBlocks(count, record_size, [&](int64_t first, int64_t last, uint8_t* bytes) -> Status {
    ANCHORSPLAT_RETURN_IF_ERROR(file.ReadAt(begin + static_cast<uint64_t>(first) * record_size, bytes,
                                            static_cast<size_t>(last - first) * record_size));
    unpack(first, last, static_cast<const uint8_t*>(bytes));
    return {};
  });
}

// Calls pack(first, last, bytes) likewise and writes the bytes. Records start at byte `begin`.
template <typename Pack>
Status WriteRecords(const OutputFile& file, uint64_t begin, int64_t count, size_t record_size, Pack&& pack) {
  return internal::ForRecordBlocks(count, record_size, [&](int64_t first, int64_t last, uint8_t* bytes) {
    pack(first, last, bytes);
    return file.WriteAt(begin + static_cast<uint64_t>(first) * record_size, bytes,
                        static_cast<size_t>(last - first) * record_size);
  });
}

}  // namespace anchorsplat
