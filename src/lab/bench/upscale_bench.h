#pragma once

#include "core/result.h"
#include "upscale/upscaler.h"

namespace anchorsplat {

struct UpscaleBenchOptions {
  int width = 200;  // of the input picture, pixels
  int height = 150;
  int repeats = 5;  // after a warm-up; the fastest counts
};

struct UpscaleBenchReport {
  int threads = 0;
  double seconds = 0;        // per picture, without reading and writing
  double multiply_adds = 0;  // per picture, without tile overlaps
  double gemm_flops = 0;     // 2·multiply-adds per second of a plain fp32 product
  double ratio = 0;          // seconds over the time for the same multiply-adds at that rate
};

// Times a network on a picture of noise. Alternates matrix product and network, so that both see the same machine
// state.
// Errors: those of Upscaler::Enlarge; kBadArgument: repeats < 1.
Result<UpscaleBenchReport> BenchUpscale(Upscaler& network, const UpscaleBenchOptions& options = {});

}  // namespace anchorsplat
