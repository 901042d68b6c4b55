#pragma once

#include "core/run_context.h"

namespace anchorsplat {

// During its lifetime, Ctrl-C, SIGTERM and SIGHUP (closed terminal, lost connection) request a stop: StopRequested()
// (core/run_context.h) becomes true. A run that cannot be resumed is abandoned: it throws RunAbandoned, which
// RunProgram reports as interrupted. A second Ctrl-C or SIGTERM ends the program at once. A second SIGHUP, which shell
// and system may both send, has no effect; under nohup SIGHUP is ignored. SIGPIPE is ignored, so that the work survives
// a lost reader such as `tee`. Only one object at a time.
class StopSignal {
 public:
  enum class Leaves { kWhatIsDone, kNothing };
  explicit StopSignal(Leaves leaves = Leaves::kWhatIsDone);
  ~StopSignal();
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;

 private:
  RunScope run_;
};

}  // namespace anchorsplat
