#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "model/published/published_network.h"

namespace anchorsplat {

struct NetworkBenchOptions {
  int repeats = 5;  // after one that warms up; the fastest counts
  Rounding rounding = Rounding::kNone;
};

// What one step of a forward pass took in the fastest repeat.
struct NetworkBenchStep {
  std::string name;          // kNetworkStepNames
  double seconds = 0;        //
  double multiply_adds = 0;  // of matrix products, attention and convolution; 0 where memory is what counts
};

struct NetworkBenchReport {
  int threads = 0;
  bool bfloat16_products = false;  // the processor has them; without, bf16 is slower than fp32
  int64_t gaussians = 0;           // N anchors
  int64_t copies = 0;              // K
  double seconds = 0;        // one forward pass, levels and heads included, without reading, cleaning and restoring
  double multiply_adds = 0;  // of the pass
  double gemm_flops = 0;  // 2·multiply-adds per second of a plain product 17020×512×2048 in the network's precision
  double ratio = 0;       // seconds over the time that product's rate would need for the same multiply-adds
  double enhance_seconds = 0;  // EnhanceWithPublishedNetwork as a whole, fastest repeat
  std::vector<NetworkBenchStep> steps;
};

// Times the network on a cloud. Matrix product and forward pass take turns, so that both see the same machine.
// Errors: those of EnhanceWithPublishedNetwork; kBadArgument when repeats < 1.
Result<NetworkBenchReport> BenchNetwork(const GaussianCloud& cloud, const PublishedNetwork& network,
                                        const NetworkBenchOptions& options = {});

}  // namespace anchorsplat
