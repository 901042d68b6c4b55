#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "fit/cloud_optimizer.h"
#include "fit/densification.h"
#include "fit/gpu_objective.h"
#include "gpu/device.h"
#include "render/gpu_cloud.h"

namespace anchorsplat {

// An Adam step on a cloud on the GPU, as CloudOptimizer::Step, and what densification accumulates with it.
struct ResidentStep {
  LearningRates rates;
  double means_rate = 0;
  int sh_degree = 0;             // coefficients of higher degrees stay
  int64_t number = 1;            // of the step, from 1
  int64_t learning = INT64_MAX;  // number of leading Gaussians to update; the others stay
  bool gathers = false;          // accumulates for densification
  bool absgrad = false;          // of DensificationOptions
  int width = 0, height = 0;     // of the gradient's picture, pixels
};

// The state of a fit on the GPU: cloud, Adam's moments and densification's sums. Target pictures belong to the
// objective. Work is recorded and runs in order; only methods that say so wait for it. Equals the CPU's up to rounding,
// with the same bits in every run.
class ResidentFit {
 public:
  // Uploads a state. Errors: not enough memory; those of GpuDevice::Allocate.
  static Result<std::unique_ptr<ResidentFit>> Begin(const std::shared_ptr<GpuDevice>& device,
                                                    const GaussianCloud& cloud, const CloudOptimizer& optimizer,
                                                    const Densification& densification);

  int64_t size() const { return cloud_.size(); }
  GpuObjective& objective() { return objective_; }

  // GpuObjective::Show of the cloud.
  Result<bool> Show(const ObjectiveOptions& options, const Camera& camera) {
    return objective_.Show(options, cloud_, origin_, camera);
  }
  // GpuObjective::Compare and an Adam step. Errors: those of the former, with nothing changed unless the device failed.
  Status Learn(const ObjectiveOptions& options, int64_t view, const ResidentStep& step);

  // Densification::Plan, from data read back. Errors: those of GpuDevice::Read.
  Result<RefinementPlan> Plan(const DensificationOptions& options, int64_t step, double scene_scale, uint64_t seed);
  // Executes a plan on the cloud and the moments and clears densification's sums. Errors: not enough memory; then
  // nothing has changed.
  Status Apply(const DensificationOptions& options, const RefinementPlan& plan);
  // CapOpacities; also zeroes their moments.
  void ResetOpacities(double cap);

  // Reads everything back. Errors: those of GpuDevice::Read; then nothing has changed.
  Status Read(GaussianCloud& cloud, CloudOptimizer& optimizer, Densification& densification) const;
  // Reads some Gaussians, in this order. Errors: as Read.
  Result<GaussianCloud> ReadRows(std::span<const int64_t> rows) const { return cloud_.ReadRows(*device_, rows); }

 private:
  explicit ResidentFit(const std::shared_ptr<GpuDevice>& device) : device_(device), objective_(device) {}
  void LearnRows(const ResidentStep& step, const GpuGradient& gradient);
  void Gather(const ResidentStep& step, const GpuGradient& gradient);
  void TakeRows(const GpuBuffer& source, int64_t limit, const GpuCloud& from, const GpuCloud& to);
  Status ReadGathered(Densification::Gathered& gathered) const;

  std::shared_ptr<GpuDevice> device_;
  GpuObjective objective_;
  GpuCloud cloud_;
  WorldOrigin origin_ = {0, 0, 0};  // of cloud_
  GpuCloud first_, second_;         // moments, in the same columns
  GpuMemory gathered_;              // vec4f [N]: grad2d, count, radii; empty if nothing is accumulated
  // From the last Plan, for Apply.
  GaussianCloud shapes_;  // without coefficients
};

}  // namespace anchorsplat
