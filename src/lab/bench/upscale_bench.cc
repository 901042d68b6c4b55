#include "bench/upscale_bench.h"

#include <algorithm>
#include <chrono>
#include <limits>

#include "bench/plain_product.h"
#include "core/parallel.h"
#include "core/random.h"

namespace anchorsplat {

Result<UpscaleBenchReport> BenchUpscale(Upscaler& network, const UpscaleBenchOptions& options) {
  if (options.repeats < 1) return Error{ErrorCode::kBadArgument, "the number of repeats must be at least 1"};
  UpscaleBenchReport report;
  report.threads = ThreadCount();
  report.seconds = std::numeric_limits<double>::infinity();
  Image image(options.width, options.height, 3);
  report.multiply_adds = network.multiply_adds_per_pixel() * static_cast<double>(image.plane());
  Random random(1);
  for (float& value : image.pixels) value = static_cast<float>(random.Uniform());
  PlainProduct product(WeightPrecision::kFloat);
  for (int i = 0; i <= options.repeats; ++i) {
    report.gemm_flops = std::max(report.gemm_flops, product.Flops());
    const auto begin = std::chrono::steady_clock::now();
    ANCHORSPLAT_ASSIGN_OR_RETURN(const Image enlarged, network.Enlarge(image));
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    if (i > 0) report.seconds = std::min(report.seconds, seconds);
  }
  report.ratio = report.seconds * report.gemm_flops / (2 * report.multiply_adds);
  return report;
}

}  // namespace anchorsplat
