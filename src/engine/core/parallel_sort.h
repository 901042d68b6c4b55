#pragma once

#ifdef ANCHORSPLAT_WORKERS
#include <algorithm>
#include <cstdint>

#include "core/parallel.h"
#else
#include <tbb/parallel_sort.h>

#include "core/parallel_section.h"
#endif

namespace anchorsplat {

// Sorts [first, last) on the threads of this thread's run. Not stable; with a total order the result is the same for
// any number of threads.
template <typename Iterator>
void ParallelSort(Iterator first, Iterator last) {
#ifdef ANCHORSPLAT_WORKERS
  const int64_t count = last - first;
  int64_t pieces = 1;
  while (pieces < ThreadCount() && count / pieces > 4096) pieces *= 2;
  const auto at = [&](int64_t piece) { return first + std::min(piece, pieces) * count / pieces; };
  ParallelFor(0, pieces, 1, [&](int64_t k, int64_t) { std::sort(at(k), at(k + 1)); });
  for (int64_t width = 1; width < pieces; width *= 2) {
    ParallelFor(0, pieces / (2 * width), 1, [&](int64_t k, int64_t) {
      std::inplace_merge(at(2 * k * width), at((2 * k + 1) * width), at((2 * k + 2) * width));
    });
  }
#else
  ParallelSection([&] { tbb::parallel_sort(first, last); });
#endif
}

}  // namespace anchorsplat
