#include "fit/gpu_adam.h"

#include "fit/wgsl.h"
#include "render/adam_runs.h"

namespace anchorsplat {

namespace {

const GpuKernel kAdamStep = {"adam_step", {wgsl::kAdamWgsl}};

// `Adam` of adam.wgsl.
struct AdamParameters {
  uint32_t rows, stride, columns, first_columns;
  float first_rate, rate, take1, keep2, take2, inverse_root, epsilon;
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
  parameters.take1 = numbers.take1;
  parameters.keep2 = numbers.keep2;
  parameters.take2 = numbers.take2;
  parameters.inverse_root = numbers.inverse_root;
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
             GpuGroups(p.rows * p.columns));
}

}  // namespace anchorsplat
