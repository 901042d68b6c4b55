#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace anchorsplat {

// Best time of one kernel over several runs, on the work of a whole forward pass.
struct KernelTiming {
  std::string name;
  double seconds = 0;
  double operations = 0;  // multiplications and additions of its matrix products
  double of_peak = 0;     // operations per second relative to the machine's peak, measured in the same minutes
};

struct KernelTimings {
  double peak_flops = 0;  // fp32, all threads
  std::vector<KernelTiming> kernels;
};

// Times attention, convolutions and linear layers of a forward pass over voxels [N,3]. Runs each kernel `repeats` times
// per block shape and sums the best times.
KernelTimings TimeKernels(const std::vector<int32_t>& voxels, int repeats);

}  // namespace anchorsplat
