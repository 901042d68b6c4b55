#pragma once

#include <cstdint>

#include "gpu/device.h"

namespace anchorsplat {

// AdamParams (fit/adam.h) for rows on the GPU.
struct GpuAdamParams {
  int64_t rows;               // N
  int64_t stride;             // numbers per row
  int64_t columns;            // updated columns per row, the first ones; ≤ stride
  int64_t first_columns;      // of these, columns at `first_rate`; the others at `rate`
  double first_rate;          // ≥ 0
  double rate;                // ≥ 0
  double beta1, beta2;        // in [0, 1)
  double epsilon;             // > 0
  int64_t step;               // t, 1 for the first step
  const GpuBuffer* gradient;  // f32 [N,stride]
  // in and out, f32 [first_row + N,stride]
  int64_t first_row;  // a multiple of 64
  const GpuBuffer* first_moment;
  const GpuBuffer* second_moment;
  const GpuBuffer* values;
};

// Records AdamStep (fit/adam.h) as fit/adam.wgsl. Equals the CPU's up to rounding; the same bits in every run.
void RecordAdamStep(const GpuAdamParams& p, GpuDevice& device);

}  // namespace anchorsplat
