#pragma once

#include <functional>

namespace anchorsplat {

// Runs code with its own parallel loops (tbb::parallel_sort) on the threads of this thread's run (core/run_context.h).
// ParallelFor does so itself.
void ParallelSection(const std::function<void()>& section);

}  // namespace anchorsplat
