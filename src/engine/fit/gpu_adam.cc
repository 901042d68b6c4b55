#include "fit/gpu_adam.h"

#include "fit/wgsl.h"
#include "render/adam_runs.h"

namespace anchorsplat {

namespace {

const GpuKernel kAdamStep = {"adam_step", {wgsl::kAdamWgsl}};

// Struct `Adam` of adam.wgsl.
struct AdamParameters {
  uint32_t rows, stride, columns, first_columns;
  float first_rate, rate, one_minus_beta1, beta2, one_minus_beta2, inverse_correction2, epsilon;
  uint32_t unused;
};

}  // namespace

void RecordAdamStep(const GpuAdamParams& p, GpuDevice& device) {
  if (p.rows <= 0 || p.columns <= 0) return;
  const AdamNumbers numbers = MakeAdamNumbers(p.beta1, p.beta2, static_cast<float>(p.epsilon), p.step);
  AdamParameters parameters{};
  parameters.stride = static_cast<uint32_t>(p.stride);
  parameters.columns = static_cast<uint32_t>(p.columns);
  parameters.first_columns = static_cast<uint32_t>(p.first_columns);
  parameters.first_rate = CorrectedRate(static_cast<float>(p.first_rate), p.beta1, p.step);
  parameters.rate = CorrectedRate(static_cast<float>(p.rate), p.beta1, p.step);
  parameters.one_minus_beta1 = numbers.one_minus_beta1;
  parameters.beta2 = numbers.beta2;
  parameters.one_minus_beta2 = numbers.one_minus_beta2;
  parameters.inverse_correction2 = numbers.inverse_correction2;
  parameters.epsilon = numbers.epsilon;
  parameters.rows = static_cast<uint32_t>(p.rows);
  const uint64_t row_bytes = static_cast<uint64_t>(p.stride) * sizeof(float);
  const uint64_t offset = static_cast<uint64_t>(p.first_row) * row_bytes;
  const uint64_t bytes = static_cast<uint64_t>(p.rows) * row_bytes;
  device.Run(kAdamStep, AsParameters(parameters),
             {{1, p.gradient, 0, bytes},
              {2, p.first_moment, offset, bytes},
              {3, p.second_moment, offset, bytes},
              {4, p.values, offset, bytes}},
             GpuWorkgroups(p.rows * p.columns));
}

}  // namespace anchorsplat
