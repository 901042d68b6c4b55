#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "core/parallel.h"
#include "kernels/benchmark/forward_mix.h"
#include "kernels/benchmark/kernel_timings.h"

// model_kernels_benchmark [repeats] [threads]
int main(int argc, char** argv) {
  const int repeats = argc > 1 ? std::max(1, std::atoi(argv[1])) : 5;
  if (argc > 2) anchorsplat::SetThreadCount(std::atoi(argv[2]));
  const anchorsplat::KernelTimings timings = anchorsplat::TimeKernels(anchorsplat::SurfaceVoxels(17020), repeats);
  std::printf("%d threads, fp32 peak %.0f GFLOP/s\n", anchorsplat::ThreadCount(), timings.peak_flops * 1e-9);
  for (const anchorsplat::KernelTiming& k : timings.kernels) {
    std::printf("%-48s %9.2f ms %7.1f GFLOP %7.1f GFLOP/s %5.1f %% of peak\n", k.name.c_str(), k.seconds * 1e3,
                k.operations * 1e-9, k.operations / k.seconds * 1e-9, 100 * k.of_peak);
  }
  return 0;
}
