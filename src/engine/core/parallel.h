#pragma once

#include <cstdint>
#include <memory>
#include <type_traits>

namespace anchorsplat {

// Sets the number of threads for parallel loops of the process; 0 = all of the machine (the default). Call it before
// the first loop, from one thread. A run may use fewer (core/run_context.h).
void SetThreadCount(int threads);
int ThreadCount();  // of this thread's run

namespace internal {
using RangeFunction = void (*)(void* context, int64_t begin, int64_t end);
void ParallelRanges(int64_t begin, int64_t end, int64_t grain, RangeFunction function, void* context);
}  // namespace internal

// Calls body(first, last) for disjoint sub-ranges that cover [begin, end), possibly in parallel. Sub-range k starts at
// begin + k·grain and has `grain` indices (the last may have fewer), for any number of threads, so per-range sums give
// the same bits on every machine. Exceptions propagate to the caller. Loops may nest.
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
