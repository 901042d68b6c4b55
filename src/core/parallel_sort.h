#pragma once

#ifdef ANCHORSPLAT_SERIAL
#include <algorithm>
#else
#include <tbb/parallel_sort.h>

#include "core/parallel_section.h"
#endif

namespace anchorsplat {

// Sorts [first, last) with the threads of this thread's run. Not stable: with a total order the result is the same
// however the work was split.
template <typename Iterator>
void ParallelSort(Iterator first, Iterator last) {
#ifdef ANCHORSPLAT_SERIAL
  std::sort(first, last);
#else
  ParallelSection([&] { tbb::parallel_sort(first, last); });
#endif
}

}  // namespace anchorsplat
