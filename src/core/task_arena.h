#pragma once

// The threads that loops of one run share. oneTBB's own; in a build without threads (ANCHORSPLAT_SERIAL: a module for
// the web, whose threads not every page may have) the thread that asks does all.
#ifndef ANCHORSPLAT_SERIAL

#include <tbb/task_arena.h>

namespace anchorsplat::internal {
using TaskArena = tbb::task_arena;
}  // namespace anchorsplat::internal

#else

namespace anchorsplat::internal {
class TaskArena {
 public:
  void initialize(int /*threads*/) {}
};
}  // namespace anchorsplat::internal

#endif
