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

// Settings of a long call. Programs that run several calls at a time give each its own:
//
//   const RunScope run({.threads = 4, .sink = mine, .stop = &cancelled});
//   auto enhanced = Enhance(cloud, options);
//
// Until the scope ends, they apply to everything this thread does and to the parallel loops it starts: messages and
// progress go to `sink`, loops use at most `threads`, and interruptible work ends cleanly once `stop` is true. Results
// do not depend on them. Runs of different threads are independent; threads started by hand belong to no run.
//
// Unset members come from the enclosing scope, or from the process (SetThreadCount, SetLogSink; no stop flag).
struct RunContext {
  int threads = 0;                          // at most; 0: no limit
  std::shared_ptr<LogSink> sink = nullptr;  // gets one event at a time
  const std::atomic<bool>* stop = nullptr;  // must outlive the scope
  // Set to true to discard the run: its next parallel loop, or the next part of the running one, throws RunAbandoned.
  // Must outlive the scope.
  const std::atomic<bool>* abandon = nullptr;
  std::optional<DeviceChoice> device = std::nullopt;  // of the rasterizer; default: the CPU
  uint64_t max_gpu_memory = 0;                        // limit in bytes; 0: kDefaultGpuMemory
};

// WebGPU cannot report how much memory is free.
inline constexpr uint64_t kDefaultGpuMemory = uint64_t{2} << 30;  // bytes

// Thrown to end an abandoned run. Resources are freed on the way, and incomplete files never get a name.
struct RunAbandoned {};

namespace internal {

// Objects that live as long as a run, one per type.
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
// The run of this thread; null if there is none.
const std::shared_ptr<Run>& CurrentRun();
// Its storage, or that of the process.
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

// Settings of this thread's run, or the defaults of RunContext.
DeviceChoice DeviceChoiceOfRun();
uint64_t MaxGpuMemoryOfRun();  // bytes

// Whether this thread's run is asked to stop. Cheap enough for every step of a loop.
bool StopRequested();

// Throws RunAbandoned if the run is abandoned. For long work without parallel loops, which check by themselves.
void LeaveIfAbandoned();

}  // namespace anchorsplat
