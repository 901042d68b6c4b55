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

// Step lengths of Kerbl et al. 2023 as gsplat's trainer has them, and Adam's constants.
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

// The rate of the means at step t (0, 1, …) of `steps`: exponential decay.
double MeansRate(const LearningRates& rates, double scene_scale, int64_t step, int64_t steps);

// How the rows of a cloud change when Gaussians come and go: first the old rows that stay, in this order, then new
// ones.
struct RowChange {
  Buffer<int64_t> kept;  // old row numbers, ascending
  int64_t fresh = 0;     // rows appended behind them
  bool any = false;      // false: all rows stay and none comes
};

// An Adam per attribute of a cloud. The moments follow the Gaussians through densification; new ones begin at zero
// while the count of steps goes on, as in gsplat.
class CloudOptimizer {
 public:
  CloudOptimizer() = default;
  explicit CloudOptimizer(const GaussianCloud& cloud);

  // One step along −gradient. `means_rate` is that of this step; SH coefficients above `sh_degree` stay.
  void Step(const LearningRates& rates, double means_rate, int sh_degree, const CloudGradient& gradient,
            GaussianCloud& cloud);
  // The same in two parts, for Rasterizer::Backward in between: what it is to do with the coefficients, which changes
  // nothing yet, and then the step of everything else.
  CoefficientStep BeginStep(const LearningRates& rates, int sh_degree, GaussianCloud& cloud);
  // Means move in `far` units.
  void FinishStep(const LearningRates& rates, double means_rate, const CloudGradient& gradient, GaussianCloud& cloud,
                  const FarUnits& far = {});

  void Apply(const RowChange& change);
  void ForgetOpacities();                          // their moments become zero
  void ForgetRows(std::span<const int64_t> rows);  // all moments of these Gaussians become zero

  int64_t steps() const { return steps_; }

  // For checkpoints: the moments by attribute, shaped like the cloud's arrays.
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

// `values` [N,width] with its rows changed: the kept ones first, then `change.fresh` rows that are not initialised.
Buffer<float> ChangeRows(const Buffer<float>& values, int64_t width, const RowChange& change);

}  // namespace anchorsplat
