#include "fit/cloud_optimizer.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "fit/adam.h"

namespace anchorsplat {

namespace {

enum Attribute : size_t { kMeans, kScales, kQuats, kOpacities, kSh };

// Scales the step from `before` to `means` [N,3] by the length factor at its start.
void Lengthen(const FarUnits& far, const Buffer<float>& before, Buffer<float>& means) {
  ParallelFor(0, static_cast<int64_t>(means.size()) / 3, 4096, [&](int64_t begin, int64_t end) {
    for (auto i = static_cast<size_t>(3 * begin); i < static_cast<size_t>(3 * end); i += 3) {
      const auto factor = static_cast<float>(far.FactorAt(before.data() + i));
      if (factor == 1) continue;
      for (size_t k = i; k < i + 3; ++k) means[k] = before[k] + factor * (means[k] - before[k]);
    }
  });
}

}  // namespace

double MeansRate(const LearningRates& rates, double scene_scale, int64_t step, int64_t steps) {
  const double done = static_cast<double>(step) / static_cast<double>(std::max<int64_t>(1, steps));
  return rates.means * scene_scale * std::pow(rates.means_decay, done);
}

CloudOptimizer::CloudOptimizer(const GaussianCloud& cloud) {
  moments_ = {{{"means", 3, {}, {}},
               {"log_scales", 3, {}, {}},
               {"quats", 4, {}, {}},
               {"opacity_logits", 1, {}, {}},
               {"sh", cloud.sh_stride(), {}, {}}}};
  for (Moments& m : moments_) {
    m.first.assign(static_cast<size_t>(cloud.size() * m.width), 0.0f);
    m.second.assign(static_cast<size_t>(cloud.size() * m.width), 0.0f);
  }
}

void CloudOptimizer::Step(const LearningRates& rates, double means_rate, int sh_degree, const CloudGradient& gradient,
                          GaussianCloud& cloud) {
  FinishStep(rates, means_rate, gradient, cloud);
  StepAttribute(kSh, 3 * ShCoefficients(std::min(sh_degree, cloud.sh_degree)), 3, rates, rates.sh0, rates.sh_rest,
                gradient.sh, cloud.sh);
}

CoefficientStep CloudOptimizer::BeginStep(const LearningRates& rates, int sh_degree, GaussianCloud& cloud) {
  const int64_t step = steps_ + 1;
  const auto corrected = [&](double rate) { return CorrectedRate(static_cast<float>(rate), rates.beta1, step); };
  Moments& m = moments_[kSh];
  return {.numbers = MakeAdamNumbers(rates.beta1, rates.beta2, static_cast<float>(rates.epsilon), step),
          .columns = 3 * ShCoefficients(std::min(sh_degree, cloud.sh_degree)),
          .first_rate = corrected(rates.sh0),
          .rate = corrected(rates.sh_rest),
          .first_moment = m.first.data(),
          .second_moment = m.second.data(),
          .values = cloud.sh.data()};
}

void CloudOptimizer::FinishStep(const LearningRates& rates, double means_rate, const CloudGradient& gradient,
                                GaussianCloud& cloud, const FarUnits& far) {
  ++steps_;
  Buffer<float> before;
  if (far.any()) before = cloud.means;
  StepAttribute(kMeans, 3, 0, rates, 0, means_rate, gradient.means, cloud.means);
  if (far.any()) Lengthen(far, before, cloud.means);
  StepAttribute(kScales, 3, 0, rates, 0, rates.scales, gradient.log_scales, cloud.log_scales);
  StepAttribute(kQuats, 4, 0, rates, 0, rates.quats, gradient.quats, cloud.quats);
  StepAttribute(kOpacities, 1, 0, rates, 0, rates.opacities, gradient.opacity_logits, cloud.opacity_logits);
}

void CloudOptimizer::StepAttribute(size_t attribute, int64_t columns, int64_t first_columns, const LearningRates& rates,
                                   double first_rate, double rate, const Buffer<float>& gradient,
                                   Buffer<float>& values) {
  Moments& m = moments_[attribute];
  AdamStep({.rows = static_cast<int64_t>(values.size()) / m.width,
            .stride = m.width,
            .columns = columns,
            .first_columns = first_columns,
            .first_rate = static_cast<float>(first_rate),
            .rate = static_cast<float>(rate),
            .beta1 = rates.beta1,
            .beta2 = rates.beta2,
            .epsilon = static_cast<float>(rates.epsilon),
            .step = steps_,
            .gradient = gradient.data(),
            .first_moment = m.first.data(),
            .second_moment = m.second.data(),
            .values = values.data()});
}

Buffer<float> ChangeRows(const Buffer<float>& values, int64_t width, const RowChange& change) {
  const auto kept = static_cast<int64_t>(change.kept.size());
  Buffer<float> out(static_cast<size_t>((kept + change.fresh) * width));
  ParallelFor(0, kept, 4096, [&](int64_t begin, int64_t end) {
    for (int64_t row = begin; row < end; ++row) {
      std::copy_n(values.data() + change.kept[static_cast<size_t>(row)] * width, width, out.data() + row * width);
    }
  });
  return out;
}

void CloudOptimizer::Apply(const RowChange& change) {
  if (!change.any) return;
  for (Moments& m : moments_) {
    for (Buffer<float>* moment : {&m.first, &m.second}) {
      *moment = ChangeRows(*moment, m.width, change);
      std::fill(moment->end() - static_cast<ptrdiff_t>(change.fresh * m.width), moment->end(), 0.0f);
    }
  }
}

void CloudOptimizer::ForgetRows(std::span<const int64_t> rows) {
  for (Moments& m : moments_) {
    for (Buffer<float>* moment : {&m.first, &m.second}) {
      for (const int64_t row : rows) std::fill_n(moment->data() + row * m.width, m.width, 0.0f);
    }
  }
}

void CloudOptimizer::ForgetOpacities() {
  Moments& m = moments_[kOpacities];
  std::fill(m.first.begin(), m.first.end(), 0.0f);
  std::fill(m.second.begin(), m.second.end(), 0.0f);
}

}  // namespace anchorsplat
