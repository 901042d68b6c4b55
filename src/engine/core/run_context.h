#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <typeindex>
#include <unordered_map>

#include "core/device_choice.h"
#include "core/log.h"

namespace anchorsplat {

// What a long call works with. Programs that make several calls at the same time give each its own:
//
//   const RunScope run({.threads = 4, .sink = mine, .stop = &cancelled});
//   auto enhanced = Enhance(cloud, options);
//
// Until the scope ends it belongs to all that this thread does, and to the parallel loops that it starts, whichever
// thread works on them: messages and progress go to `sink`, loops use at most `threads`, and what can be interrupted
// ends in order when `stop` becomes true. Results do not depend on any of it. Runs of two threads do not see each
// other. Threads that are started by hand take part in no run.
//
// What is left out is that of the scope around this one, or of the process (SetThreadCount, SetLogSink; no stop flag).
struct RunContext {
  int threads = 0;                          // at most; 0: no limit of its own
  std::shared_ptr<LogSink> sink = nullptr;  // its events are serialised
  const std::atomic<bool>* stop = nullptr;  // must outlive the scope
  // Becomes true when nothing of the run is wanted any more: its next parallel loop, or the next part of the one that
  // runs, throws RunAbandoned, whatever it is about. Must outlive the scope.
  const std::atomic<bool>* abandon = nullptr;
  std::optional<DeviceChoice> device = std::nullopt;  // where pictures are rasterized; the CPU where no run says
  uint64_t max_gpu_memory = 0;                        // bytes of GPU memory at most; 0: kDefaultGpuMemory
};

// WebGPU cannot be asked how much memory is free.
inline constexpr uint64_t kDefaultGpuMemory = uint64_t{2} << 30;  // bytes

// Ends a run from inside. What a run holds is given back on the way, and files that are not whole are never named.
struct RunAbandoned {};

namespace internal {

// What is kept for as long as a run, one of each type.
class RunStorage {
 public:
  template <typename T>
  std::shared_ptr<T> Get() {
    const std::lock_guard lock(mutex_);
    std::shared_ptr<void>& kept = kept_[std::type_index(typeid(T))];
    if (kept == nullptr) kept = std::make_shared<T>();
    return std::static_pointer_cast<T>(kept);
  }

 private:
  std::mutex mutex_;
  std::unordered_map<std::type_index, std::shared_ptr<void>> kept_;
};

struct Run;
// Of the run that this thread takes part in; null where there is none.
const std::shared_ptr<Run>& CurrentRun();
// Of that run or, without one, of the process.
RunStorage& CurrentStorage();

}  // namespace internal

class RunScope {
 public:
  explicit RunScope(RunContext context);
  ~RunScope();
  RunScope(const RunScope&) = delete;
  RunScope& operator=(const RunScope&) = delete;

 private:
  std::shared_ptr<internal::Run> before_;
};

// Of the run that this thread takes part in, or the defaults of RunContext.
DeviceChoice DeviceChoiceOfRun();
uint64_t MaxGpuMemoryOfRun();  // bytes

// Whether the run that this thread takes part in is asked to end. Cheap: long loops ask at every step.
bool StopRequested();

// Throws RunAbandoned when the run is. For what takes long without parallel loops; these ask by themselves.
void LeaveIfAbandoned();

}  // namespace anchorsplat
