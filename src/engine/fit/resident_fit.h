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

// A step of Adam on a cloud on the GPU, as CloudOptimizer::Step makes it, and what densification gathers on the way.
struct ResidentStep {
  LearningRates rates;
  double means_rate = 0;
  int sh_degree = 0;             // coefficients above stay
  int64_t number = 1;            // of the step: 1 for the first
  int64_t learning = INT64_MAX;  // Gaussians, the first ones; the others stay
  bool gathers = false;
  bool absgrad = false;       // of DensificationOptions
  int width = 0, height = 0;  // pixels of the picture whose gradient it is
};

// What changes during a fit, on the GPU: the cloud, Adam's moments and what densification gathers. Pictures are the
// objective's. Everything is recorded and done in order; only what says so waits for it.
//
// The values are those of the CPU up to rounding, and the same bits at every run.
class ResidentFit {
 public:
  // Uploads them. Errors: no room for them, of GpuDevice::Allocate.
  static Result<std::unique_ptr<ResidentFit>> Begin(const std::shared_ptr<GpuDevice>& device,
                                                    const GaussianCloud& cloud, const CloudOptimizer& optimizer,
                                                    const Densification& densification);

  int64_t size() const { return cloud_.size(); }
  GpuObjective& objective() { return objective_; }

  // GpuObjective::Show of the cloud.
  Result<bool> Show(const ObjectiveOptions& options, const Camera& camera) {
    return objective_.Show(options, cloud_, origin_, camera);
  }
  // GpuObjective::Compare, and the step along its gradient. Errors: of the former, before anything has changed unless
  // the device has failed.
  Status Learn(const ObjectiveOptions& options, int64_t view, const ResidentStep& step);

  // Densification::Plan: what it looks at is read. Errors: of GpuDevice::Read.
  Result<RefinementPlan> Plan(const DensificationOptions& options, int64_t step, double scene_scale, uint64_t seed);
  // What the plan says: rows go and come in the cloud and in the moments, and nothing is gathered yet of any.
  // Errors: no room, before anything has changed.
  Status Apply(const DensificationOptions& options, const RefinementPlan& plan);
  // CapOpacities, and their moments are forgotten.
  void ResetOpacities(double cap);

  // All of it, to where it came from. Errors: those of GpuDevice::Read; then nothing has changed.
  Status Read(GaussianCloud& cloud, CloudOptimizer& optimizer, Densification& densification) const;
  // Some Gaussians, in this order. Errors: as Read.
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
  WorldOrigin origin_ = {0, 0, 0};  // of it
  GpuCloud first_, second_;         // moments, in the same columns
  GpuMemory gathered_;              // vec4f [N]: grad2d, count, radii; none where nothing is gathered
  // Of the last Plan, which Apply goes on with.
  GaussianCloud shapes_;  // without coefficients
};

}  // namespace anchorsplat
