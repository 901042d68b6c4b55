#pragma once

#include <anchorsplat/export.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>

namespace anchorsplat {

enum class MessageLevel { kInfo, kWarning };

// How far a task has come. Tasks of a call follow each other.
struct TaskProgress {
  std::string task = {};  // "fit"
  int64_t done = 0;       // steps
  int64_t total = 0;
  std::string note = {};  // "27.31 dB, 84,120 Gaussians"
  bool ended = false;
};

// How a call is run; results do not depend on any of it, but for rounding on a GPU. Every function that may take long
// takes one as its last argument. Calls of several threads do not see each other: each has its own limit, callbacks and
// flag.
//
// Callbacks come from any thread of the call, one at a time. They must not throw. Without them nothing is said: the
// library writes to neither stdout nor stderr.
struct RunSettings {
  int threads = 0;                                                              // at most; 0: all of the machine
  std::function<void(MessageLevel, const std::string& sentence)> message = {};  // may be empty
  std::function<void(const TaskProgress&)> progress = {};                       // may be empty
  // Becomes true when the call is to end: optimisations return what they have so far and say so, others a
  // FailureKind::kStopped, those that cannot tell go on. Must outlive the call.
  const std::atomic<bool>* stop = nullptr;
  // Becomes true when nothing of the call is wanted any more: it ends at once and without a result, whatever it is
  // about, as a FailureKind::kStopped. Files appear whole or not at all. Must outlive the call.
  const std::atomic<bool>* abandon = nullptr;
  // What rasterizes (docs/gpu.md): "cpu"; "gpu", the first that can be used; "auto", a real GPU where there is one,
  // else the CPU; or the number of an adapter, as `anchorsplat doctor` lists them. What cannot be had is a
  // FailureKind::kNotFound before the call begins, another word a kBadArgument. A GPU that is lost meanwhile is told by
  // a message, and the call goes on on the CPU.
  std::string device = "cpu";
  uint64_t max_gpu_memory = 0;  // bytes of it at most; 0: 2 GiB
};

// "0.1.0", of the library that is loaded.
ANCHORSPLAT_PUBLIC const char* LibraryVersion();

}  // namespace anchorsplat
