#pragma once

// Threads shared by the loops of one run: a oneTBB arena, or a count of helpers from core/workers
// (ANCHORSPLAT_WORKERS).
#ifndef ANCHORSPLAT_WORKERS

#include <tbb/task_arena.h>

namespace anchorsplat::internal {
using TaskArena = tbb::task_arena;
}  // namespace anchorsplat::internal

#else

#include <climits>

namespace anchorsplat::internal {
// Guarded by the mutex of the pool.
class TaskArena {
 public:
  void initialize(int threads) { free_ = threads - 1; }
  bool Enter() {
    if (free_ == 0) return false;
    --free_;
    return true;
  }
  void Leave() { ++free_; }

 private:
  int free_ = INT_MAX;
};
}  // namespace anchorsplat::internal

#endif
