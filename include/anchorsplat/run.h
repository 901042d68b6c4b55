#pragma once

#include <anchorsplat/export.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>

namespace anchorsplat {

enum class MessageLevel { kInfo, kWarning };

// Progress of a task. A call's tasks run one after another.
struct TaskProgress {
  std::string task = {};  // "fit"
  int64_t done = 0;       // steps
  int64_t total = 0;
  std::string note = {};  // "27.31 dB, 84,120 Gaussians"
  bool ended = false;
};

// How a call is run. Does not affect results, except for rounding on a GPU. Every function that may take long accepts
// one as its last argument. Concurrent calls are independent: each has its own limits, callbacks and flags.
//
// Callbacks may come from any thread of the call, but one at a time. They must not throw. The library itself never
// writes to stdout or stderr.
struct RunSettings {
  int threads = 0;                                                              // maximum; 0: all of the machine
  std::function<void(MessageLevel, const std::string& sentence)> message = {};  // may be empty
  std::function<void(const TaskProgress&)> progress = {};                       // may be empty
  // Set to true to stop the call: optimisations return their result so far, marked as stopped; others fail with
  // FailureKind::kStopped; those that cannot stop continue. Must outlive the call.
  const std::atomic<bool>* stop = nullptr;
  // Set to true to abandon the call: it ends at once without a result, with FailureKind::kStopped. Files still appear
  // whole or not at all. Must outlive the call.
  const std::atomic<bool>* abandon = nullptr;
  // What rasterizes (docs/gpu.md): "cpu"; "gpu": the first usable one; "auto": a real GPU if there is one, else the
  // CPU; or an adapter's number in `anchorsplat doctor`. Unavailable: FailureKind::kNotFound before the call begins;
  // another word: kBadArgument. If a GPU is lost during the call, a message says so and the call continues on the CPU.
  std::string device = "cpu";
  uint64_t max_gpu_memory = 0;  // bytes; 0: 2 GiB
};

// Version of the loaded library, "0.1.0".
ANCHORSPLAT_PUBLIC const char* LibraryVersion();

}  // namespace anchorsplat
