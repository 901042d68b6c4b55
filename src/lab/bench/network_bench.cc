#include "bench/network_bench.h"

#include <algorithm>
#include <chrono>
#include <limits>

#include "bench/plain_product.h"
#include "core/parallel.h"
#include "kernels/bfloat16_tile.h"
#include "published/enhance_with_published.h"

namespace anchorsplat {

namespace {

double Seconds(const std::chrono::steady_clock::time_point& begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

}  // namespace

Result<NetworkBenchReport> BenchNetwork(const GaussianCloud& cloud, const PublishedNetwork& network,
                                        const NetworkBenchOptions& options) {
  if (options.repeats < 1) return Error{ErrorCode::kBadArgument, "the number of repeats must be at least 1"};
  NetworkBenchReport report;
  report.threads = ThreadCount();
  report.bfloat16_products = UsesBFloat16Dot();
  report.copies = network.config().copies;
  report.seconds = report.enhance_seconds = std::numeric_limits<double>::infinity();
  PlainProduct product(network.precision());
  for (int i = 0; i <= options.repeats; ++i) {
    report.gemm_flops = std::max(report.gemm_flops, product.Flops());
    NetworkProfile profile;
    PublishedOptions model;
    model.rounding = options.rounding;
    model.profile = &profile;
    const auto begin = std::chrono::steady_clock::now();
    ANCHORSPLAT_ASSIGN_OR_RETURN(const PublishedResult result, EnhanceWithPublishedNetwork(cloud, network, model));
    const double enhance_seconds = Seconds(begin);
    if (i == 0) continue;
    report.enhance_seconds = std::min(report.enhance_seconds, enhance_seconds);
    if (profile.Seconds() >= report.seconds) continue;
    report.seconds = profile.Seconds();
    report.multiply_adds = profile.MultiplyAdds();
    report.gaussians = result.report.anchors;
    report.steps.clear();
    for (size_t s = 0; s < kNetworkSteps; ++s) {
      report.steps.push_back({kNetworkStepNames[s], profile.seconds[s], profile.multiply_adds[s]});
    }
  }
  report.ratio = report.seconds * report.gemm_flops / (2 * report.multiply_adds);
  return report;
}

}  // namespace anchorsplat
