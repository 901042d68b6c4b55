#pragma once

#include <functional>

namespace anchorsplat {

// Calls what has parallel loops of its own (tbb::parallel_sort) where this thread's run has its threads
// (core/run_context.h); core/parallel.h does that by itself.
void ParallelSection(const std::function<void()>& section);

}  // namespace anchorsplat
