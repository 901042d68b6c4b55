#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "core/buffer.h"
#include "core/gaussian_cloud.h"
#include "fit/far_units.h"
#include "render/rasterizer.h"

namespace anchorsplat {

// Learning rates of Kerbl et al. 2023 as in gsplat's trainer, and Adam's constants.
struct LearningRates {
  double means = 1.6e-4;  // × scene scale; decays to `means_decay` of it at the last step
  double means_decay = 0.01;
  double scales = 5e-3;     // of log-scales
  double opacities = 5e-2;  // of logits
  double quats = 1e-3;
  double sh0 = 2.5e-3;
  double sh_rest = 2.5e-3 / 20;
  double beta1 = 0.9, beta2 = 0.999, epsilon = 1e-15;
};

// Learning rate of the means at step t (0, 1, …) of `steps`: exponential decay.
double MeansRate(const LearningRates& rates, double scene_scale, int64_t step, int64_t steps);

// How rows change when Gaussians are added and removed: kept old rows in order, then new ones.
struct RowChange {
  Buffer<int64_t> kept;  // old row numbers, ascending
  int64_t fresh = 0;     // number of rows appended
  bool any = false;      // false: nothing changes
};

// Adam for each attribute of a cloud. Moments follow Gaussians through densification. As in gsplat, those of new
// Gaussians start at zero while the step count continues.
class CloudOptimizer {
 public:
  CloudOptimizer() = default;
  explicit CloudOptimizer(const GaussianCloud& cloud);

  // One descent step. `means_rate`: for this step. SH coefficients above `sh_degree` stay.
  void Step(const LearningRates& rates, double means_rate, int sh_degree, const CloudGradient& gradient,
            GaussianCloud& cloud);
  // Step in two parts, around Rasterizer::Backward: BeginStep describes the update of SH coefficients that Backward is
  // to make, and FinishStep updates everything else.
  CoefficientStep BeginStep(const LearningRates& rates, int sh_degree, GaussianCloud& cloud);
  // `far`: scales the steps of means.
  void FinishStep(const LearningRates& rates, double means_rate, const CloudGradient& gradient, GaussianCloud& cloud,
                  const FarUnits& far = {});

  void Apply(const RowChange& change);
  void ForgetOpacities();                          // zeroes their moments
  void ForgetRows(std::span<const int64_t> rows);  // zeroes all moments of these Gaussians

  int64_t steps() const { return steps_; }

  // For checkpoints: moments by attribute, shaped like the cloud's arrays.
  struct Moments {
    std::string_view attribute;
    int64_t width = 0;  // numbers per Gaussian
    Buffer<float> first, second;
  };
  std::span<const Moments> moments() const { return moments_; }
  std::span<Moments> moments() { return moments_; }
  void set_steps(int64_t steps) { steps_ = steps; }

 private:
  void StepAttribute(size_t attribute, int64_t columns, int64_t first_columns, const LearningRates& rates,
                     double first_rate, double rate, const Buffer<float>& gradient, Buffer<float>& values);

  std::array<Moments, 5> moments_;
  int64_t steps_ = 0;
};

// `values` [N,width] after a row change: kept rows, then `change.fresh` uninitialised ones.
Buffer<float> ChangeRows(const Buffer<float>& values, int64_t width, const RowChange& change);

}  // namespace anchorsplat
