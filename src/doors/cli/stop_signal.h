#pragma once

#include "core/run_context.h"

namespace anchorsplat {

// While the object lives, Ctrl-C, SIGTERM and SIGHUP, which a closed terminal or a lost connection sends, ask for an
// end: StopRequested() (core/run_context.h) becomes true, and where nothing of the work is wanted then, as there is no
// going on from it, the run is abandoned: RunAbandoned comes out of it, which RunProgram tells as interrupted. The
// second Ctrl-C or SIGTERM ends the program at once; SIGHUP may come twice by itself, from the shell and from the
// system, and changes nothing more. It is not listened to under nohup. A pipe whose reader has gone (SIGPIPE: `2>&1 |
// tee` dies with the terminal, too) ends nothing: what was to be said is lost, not the work. One at a time.
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
