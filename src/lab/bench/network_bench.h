#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "published/published_network.h"

namespace anchorsplat {

struct NetworkBenchOptions {
  int repeats = 5;  // after a warm-up; the fastest counts
  Rounding rounding = Rounding::kNone;
};

// Time of one step of a forward pass in the fastest repeat.
struct NetworkBenchStep {
  std::string name;  // kNetworkStepNames
  double seconds = 0;
  double multiply_adds = 0;  // of matrix products, attention and convolution; 0 for memory-bound steps
};

struct NetworkBenchReport {
  int threads = 0;
  bool bfloat16_products = false;  // whether the processor has them; without, bf16 is slower than fp32
  int64_t gaussians = 0;           // N anchors
  int64_t copies = 0;              // K
  double seconds = 0;          // one forward pass including levels and heads; without reading, cleaning, denormalising
  double multiply_adds = 0;    // of the pass
  double gemm_flops = 0;       // 2·multiply-adds per second of a 17020×512×2048 product in the network's precision
  double ratio = 0;            // seconds over the time for the same multiply-adds at that rate
  double enhance_seconds = 0;  // EnhanceWithPublishedNetwork in total, fastest repeat
  std::vector<NetworkBenchStep> steps;
};

// Times the network on a cloud. Alternates matrix product and forward pass, so that both see the same machine state.
// Errors: those of EnhanceWithPublishedNetwork; kBadArgument: repeats < 1.
Result<NetworkBenchReport> BenchNetwork(const GaussianCloud& cloud, const PublishedNetwork& network,
                                        const NetworkBenchOptions& options = {});

}  // namespace anchorsplat
