#include "fit/residence.h"

#include <utility>

#include "core/log.h"
#include "core/text.h"
#include "gpu/open_gpu.h"

namespace anchorsplat {

void Residence::MoveToGpu(const FitState& state) {
  fit_.reset();
  Result<std::shared_ptr<GpuDevice>> device = GpuOfRun();
  if (!device.ok()) GiveUpGpu(device.error());
  if (!device.ok() || *device == nullptr) return;
  Result<std::unique_ptr<ResidentFit>> fit =
      ResidentFit::Begin(*device, state.cloud, state.optimizer, state.densification);
  if (!fit.ok()) {
    LogWarning(Cat("the GPU renders, but the Gaussians stay in main memory: ", fit.error().message));
    return;
  }
  fit_ = std::move(fit).value();
  learned_ = step_ = state.step;
  exposures_ = state.exposures;
}

Status Residence::CopyToHost(FitState& state) {
  ANCHORSPLAT_RETURN_IF_ERROR(fit_->Read(state.cloud, state.optimizer, state.densification));
  state.optimizer.set_steps(learned_);
  step_ = state.step;
  exposures_ = state.exposures;
  return {};
}

Status Residence::MoveToHost(FitState& state) {
  ANCHORSPLAT_RETURN_IF_ERROR(CopyToHost(state));
  fit_.reset();
  return {};
}

bool Residence::MoveToHost(FitState& state, const Error& why) {
  const Status home = MoveToHost(state);
  if (home.ok()) {
    LogWarning(Cat("moving the Gaussians back to main memory and continuing there: ", why.message));
    return true;
  }
  fit_.reset();
  GiveUpGpu(home.error());
  if (state.step != step_) {
    LogWarning(Cat("continuing from step ", WithThousands(step_), ", the last one copied to main memory"));
  }
  state.step = step_;
  state.optimizer.set_steps(step_);
  state.exposures = exposures_;
  return false;
}

}  // namespace anchorsplat
