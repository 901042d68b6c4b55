#include "gpu/gpu_of_run.h"

#include "core/log.h"
#include "core/run_context.h"
#include "core/text.h"
#include "gpu/open_gpu.h"

namespace anchorsplat {

Result<std::shared_ptr<GpuDevice>> GpuOfRun() {
  using Device = std::shared_ptr<GpuDevice>;
  const DeviceChoice choice = DeviceChoiceOfRun();
  if (choice.kind == DeviceChoice::Kind::kCpu) return Device();
  const auto state = internal::CurrentStorage().Get<internal::GpuStateOfRun>();
  const std::lock_guard lock(state->mutex);
  if (!state->given_up.empty()) return Device();
  if (state->for_test) return state->for_test;
  if (!state->opened || state->opened_for != choice) {
    state->opened = OpenGpu(choice);
    state->opened_for = choice;
  }
  if (!state->opened->ok() && choice.kind == DeviceChoice::Kind::kAuto) return Device();
  return *state->opened;
}

void GiveUpGpu(const Error& reason) {
  const auto state = internal::CurrentStorage().Get<internal::GpuStateOfRun>();
  {
    const std::lock_guard lock(state->mutex);
    if (!state->given_up.empty()) return;
    state->given_up = reason.message;
    state->opened.reset();
  }
  LogWarning(Cat("Continuing on the CPU, as the GPU failed: ", reason.message));
}

std::string WhyGpuWasGivenUp() {
  const auto state = internal::CurrentStorage().Get<internal::GpuStateOfRun>();
  const std::lock_guard lock(state->mutex);
  return state->given_up;
}

}  // namespace anchorsplat
