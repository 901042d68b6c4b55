#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/result.h"

namespace anchorsplat {

// A program to run as a separate process, so that memory errors cannot affect others.
struct ProcessTask {
  std::vector<std::string> command;  // program and arguments
  std::filesystem::path log;         // receives stdout and stderr; replaced
};

struct ProcessEnd {
  int exit_code = 0;       // if it exited
  int signal = 0;          // otherwise the signal that killed it
  bool timed_out = false;  // killed by us for taking too long
  double seconds = 0;
  bool ok() const { return exit_code == 0 && signal == 0 && !timed_out; }
};

struct ProcessPoolOptions {
  int jobs = 1;                // concurrent processes
  double timeout_seconds = 0;  // per process; 0: none
};

// Runs `count` processes, starting `task(i)` in order. Calls `ended(i, end)` on the calling thread whenever one has
// ended. Each has its own process group, which Ctrl-C at the terminal does not reach. It is terminated (SIGTERM, ten
// seconds later SIGKILL) when its time is up or the run is asked to stop (core/run_context.h).
//
// `ended` may return false to stop. Errors: kIo if a process cannot be started; running ones are ended first.
Status RunProcesses(int64_t count, const std::function<ProcessTask(int64_t)>& task,
                    const std::function<bool(int64_t, const ProcessEnd&)>& ended, const ProcessPoolOptions& options);

// The path of the running program.
std::filesystem::path OwnProgram();

// For processes started by RunProcesses: makes this process end when its parent does, for whatever reason.
void DieWithParent();

}  // namespace anchorsplat
