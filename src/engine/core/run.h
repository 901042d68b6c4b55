#pragma once

#include <memory>
#include <mutex>

#include "core/run_context.h"
#include "core/task_arena.h"

namespace anchorsplat::internal {

// A run as log.cc and parallel.cc see it. Of others, only threads that are started by hand need it: for TakePart.
struct Run {
  RunContext context;  // complete: what was left out is filled in, as far as an outer run has it
  std::mutex log_mutex;
  std::shared_ptr<RunStorage> storage;
  TaskArena arena;  // loops of two runs do not wait for each other's work
};

// Makes a thread take part in a run.
class TakePart {
 public:
  explicit TakePart(const std::shared_ptr<Run>& run);
  ~TakePart();
  TakePart(const TakePart&) = delete;
  TakePart& operator=(const TakePart&) = delete;

 private:
  std::shared_ptr<Run> before_;
};

}  // namespace anchorsplat::internal
