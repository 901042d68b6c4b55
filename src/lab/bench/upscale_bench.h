#pragma once

#include "core/result.h"
#include "upscale/upscaler.h"

namespace anchorsplat {

struct UpscaleBenchOptions {
  int width = 200;  // pixels of the picture that is enlarged
  int height = 150;
  int repeats = 5;  // after one that warms up; the fastest counts
};

struct UpscaleBenchReport {
  int threads = 0;
  double seconds = 0;        // of one picture, without reading and writing
  double multiply_adds = 0;  // of it, without what tiles do twice
  double gemm_flops = 0;     // 2·multiply-adds per second of a plain product in fp32
  double ratio = 0;          // seconds over the time that this rate would need for the same multiply-adds
};

// Times a network on a picture of noise. Matrix product and network take turns, so that both see the same machine.
// Errors: those of Upscaler::Enlarge; kBadArgument when repeats < 1.
Result<UpscaleBenchReport> BenchUpscale(Upscaler& network, const UpscaleBenchOptions& options = {});

}  // namespace anchorsplat
