#include "core/parallel.h"

#include <algorithm>

#include "core/run.h"

// Parallel loops of a build without threads: chunk by chunk, in order.
namespace anchorsplat {

void SetThreadCount(int /*threads*/) {}
int ThreadCount() { return 1; }

namespace internal {

void ParallelRanges(int64_t begin, int64_t end, int64_t grain, RangeFunction function, void* context) {
  grain = std::max<int64_t>(1, grain);
  for (int64_t first = begin; first < end;) {
    LeaveIfAbandoned();
    // Not first + grain: a loop may end where int64_t does.
    const int64_t last = end - first > grain ? first + grain : end;
    function(context, first, last);
    first = last;
  }
}

}  // namespace internal

}  // namespace anchorsplat
