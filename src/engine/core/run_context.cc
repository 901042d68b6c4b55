#include "core/run_context.h"

#include <utility>

#include "core/parallel.h"
#include "core/per_thread.h"
#include "core/run.h"

namespace anchorsplat {

namespace internal {

namespace {
std::shared_ptr<Run>& OwnRun() { return PerThread<std::shared_ptr<Run>>(); }
}  // namespace

const std::shared_ptr<Run>& CurrentRun() { return OwnRun(); }

RunStorage& CurrentStorage() {
  static RunStorage of_process;
  const std::shared_ptr<Run>& run = CurrentRun();
  return run ? *run->storage : of_process;
}

JoinRun::JoinRun(const std::shared_ptr<Run>& run) : before_(std::exchange(OwnRun(), run)) {}
JoinRun::~JoinRun() { OwnRun() = std::move(before_); }

}  // namespace internal

RunScope::RunScope(RunContext context) : before_(internal::CurrentRun()) {
  auto run = std::make_shared<internal::Run>();
  if (before_) {
    if (context.threads <= 0) context.threads = before_->context.threads;
    if (!context.sink) context.sink = before_->context.sink;
    if (context.stop == nullptr) context.stop = before_->context.stop;
    if (context.abandon == nullptr) context.abandon = before_->context.abandon;
    if (!context.device) context.device = before_->context.device;
    if (context.max_gpu_memory == 0) context.max_gpu_memory = before_->context.max_gpu_memory;
  }
  run->context = std::move(context);
  run->storage = before_ ? before_->storage : std::make_shared<internal::RunStorage>();
  internal::OwnRun() = run;
  if (run->context.threads > 0) run->arena.initialize(ThreadCount());  // oneTBB warns above the machine's count
}

RunScope::~RunScope() { internal::OwnRun() = std::move(before_); }

DeviceChoice DeviceChoiceOfRun() {
  const auto& run = internal::CurrentRun();
  return run ? run->context.device.value_or(DeviceChoice{}) : DeviceChoice{};
}

uint64_t MaxGpuMemoryOfRun() {
  const auto& run = internal::CurrentRun();
  return run && run->context.max_gpu_memory > 0 ? run->context.max_gpu_memory : kDefaultGpuMemory;
}

bool StopRequested() {
  const auto& run = internal::CurrentRun();
  return run && run->context.stop != nullptr && run->context.stop->load(std::memory_order_relaxed);
}

void LeaveIfAbandoned() {
  const auto& run = internal::CurrentRun();
  if (run && run->context.abandon != nullptr && run->context.abandon->load(std::memory_order_relaxed)) {
    throw RunAbandoned();
  }
}

}  // namespace anchorsplat
