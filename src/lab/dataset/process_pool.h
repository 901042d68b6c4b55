#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/result.h"

namespace anchorsplat {

// A program to be run by itself: what it does to its own memory is no danger to others.
struct ProcessTask {
  std::vector<std::string> command;  // program and arguments
  std::filesystem::path log;         // where its stdout and stderr go; replaced
};

struct ProcessEnd {
  int exit_code = 0;       // where it ended by itself
  int signal = 0;          // else what ended it
  bool timed_out = false;  // by us, because it took too long
  double seconds = 0;
  bool ok() const { return exit_code == 0 && signal == 0 && !timed_out; }
};

struct ProcessPoolOptions {
  int jobs = 1;                // at the same time
  double timeout_seconds = 0;  // of one process; 0: none
};

// Runs `count` processes, `task(i)` in order as places become free; `ended(i, end)` is called from the calling thread
// as soon as one has ended. Each has a process group of its own, which a Ctrl-C at the terminal does not reach, and is
// asked to end (SIGTERM, ten seconds later SIGKILL) when its time is up or the run is asked to stop
// (core/run_context.h).
//
// Errors: kIo when a process cannot be started at all; the others are ended first. `ended` may return false to stop.
Status RunProcesses(int64_t count, const std::function<ProcessTask(int64_t)>& task,
                    const std::function<bool(int64_t, const ProcessEnd&)>& ended, const ProcessPoolOptions& options);

// The path of the running program.
std::filesystem::path OwnProgram();

// For a process started by RunProcesses: ends with its parent, however that ends.
void DieWithParent();

}  // namespace anchorsplat
