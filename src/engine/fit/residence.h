#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "core/buffer.h"
#include "core/result.h"
#include "fit/fit_state.h"
#include "fit/resident_fit.h"

namespace anchorsplat {

// Steps between copies of a GPU state to host memory, which remain if the GPU is lost.
inline constexpr int64_t kCopyToHostEvery = 500;

// Tracks where an optimisation's state lives: in host memory, or on the run's GPU with an older copy in host memory.
// While it is on the GPU, only `step` and `exposures` of the FitState are current; the rest is from the last copy.
class Residence {
 public:
  // Moves the state to the run's GPU if there is one with enough memory; logs if not.
  void MoveToGpu(const FitState& state);

  // The state on the GPU, of which `state` is an older copy; null if it is in host memory.
  ResidentFit* resident() const { return fit_.get(); }
  // Call after every ResidentFit::Learn.
  void CountStep() { ++learned_; }
  // Whether a copy is due after this many steps.
  static bool IsCopyDue(int64_t step) { return step % kCopyToHostEvery == 0; }

  // Updates `state`; the GPU keeps it. Errors: those of GpuDevice::Read; then nothing has changed.
  Status CopyToHost(FitState& state);
  // Moves the state to host memory and continues on the CPU because of `why`. True: it is current. False: the GPU is
  // lost, and work must continue from the last copy's step.
  bool MoveToHost(FitState& state, const Error& why);
  // The same without a failure. Errors: those of CopyToHost.
  Status MoveToHost(FitState& state);

 private:
  std::unique_ptr<ResidentFit> fit_;
  int64_t learned_ = 0;  // steps made on the GPU
  // At the last copy.
  int64_t step_ = 0;
  Buffer<float> exposures_;
};

}  // namespace anchorsplat
