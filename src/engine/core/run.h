#pragma once

#include <memory>
#include <mutex>

#include "core/run_context.h"
#include "core/task_arena.h"

namespace anchorsplat::internal {

// A run, as log.cc and parallel.cc see it. Other code needs it only to make hand-started threads join a run (JoinRun).
struct Run {
  RunContext context;  // complete: defaults come from the outer run
  std::mutex log_mutex;
  std::shared_ptr<RunStorage> storage;
  TaskArena arena;  // loops of two runs do not wait for each other's work
};

// Makes the calling thread part of a run until destroyed.
class JoinRun {
 public:
  explicit JoinRun(const std::shared_ptr<Run>& run);
  ~JoinRun();
  JoinRun(const JoinRun&) = delete;
  JoinRun& operator=(const JoinRun&) = delete;

 private:
  std::shared_ptr<Run> before_;
};

}  // namespace anchorsplat::internal
