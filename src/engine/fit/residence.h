#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "core/buffer.h"
#include "core/result.h"
#include "fit/fit_state.h"
#include "fit/resident_fit.h"

namespace anchorsplat {

// Steps between two copies of a resident state in host memory, which is what is left of it when a GPU is lost.
inline constexpr int64_t kCopyHomeEvery = 500;

// Where the state of an optimisation is: in host memory, or on the GPU of the run with an older copy in host memory. Of
// a FitState that is away, `step` and `exposures` are those of now, and the rest is as it was at the last copy.
class Residence {
 public:
  // Moves the state to the GPU of the run, if there is one and room on it; says so where there is none.
  void MoveIn(const FitState& state);

  // The state on the GPU, of which `state` is the copy; null: it is at home.
  ResidentFit* away() const { return fit_.get(); }
  // To be called after every ResidentFit::Learn.
  void CountStep() { ++learned_; }
  // Whether a copy is due after so many steps.
  static bool IsCopyDue(int64_t step) { return step % kCopyHomeEvery == 0; }

  // Makes `state` that of now. It stays away. Errors: of GpuDevice::Read; then nothing has changed.
  Status CopyHome(FitState& state);
  // The state comes home for good, and the work goes on on the CPU because of `why`. True: it is that of now. False:
  // the GPU is lost, and it is that of the last copy, from whose step the work has to go on.
  bool MoveOut(FitState& state, const Error& why);
  // The same where there is nothing wrong. Errors: those of CopyHome.
  Status MoveOut(FitState& state);

 private:
  std::unique_ptr<ResidentFit> fit_;
  int64_t learned_ = 0;  // steps of Adam
  // Of the copy.
  int64_t step_ = 0;
  Buffer<float> exposures_;
};

}  // namespace anchorsplat
