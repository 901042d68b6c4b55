#pragma once

#include <cstdint>
#include <memory>
#include <type_traits>

namespace anchorsplat {

// Threads that parallel loops may use, for the whole process; 0 = as many as the machine has (the default). Call it
// before the first loop, from one thread. A run may have fewer (core/run_context.h).
void SetThreadCount(int threads);
int ThreadCount();  // of the run that this thread takes part in

namespace internal {
using RangeFunction = void (*)(void* context, int64_t begin, int64_t end);
void ParallelRanges(int64_t begin, int64_t end, int64_t grain, RangeFunction function, void* context);
}  // namespace internal

// Calls body(first, last) for disjoint sub-ranges that cover [begin, end), possibly at the same time. Every sub-range
// starts at begin + k·grain and holds `grain` indices (the last may be shorter), whatever the number of threads, so a
// body that sums per sub-range gives the same bits on every machine. Exceptions reach the caller. Loops may be nested.
template <typename Body>
void ParallelFor(int64_t begin, int64_t end, int64_t grain, Body&& body) {
  internal::ParallelRanges(
      begin, end, grain,
      [](void* context, int64_t first, int64_t last) {
        (*static_cast<std::remove_reference_t<Body>*>(context))(first, last);
      },
      const_cast<void*>(static_cast<const void*>(std::addressof(body))));
}

}  // namespace anchorsplat
