#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace anchorsplat {

// The best of several runs of one kernel on the work of a whole forward pass.
struct KernelTiming {
  std::string name;
  double seconds = 0;
  double operations = 0;  // multiplications and additions of its matrix products
  double of_peak = 0;     // operations per second over the machine's best in the same minutes
};

struct KernelTimings {
  double peak_flops = 0;  // fp32, all threads
  std::vector<KernelTiming> kernels;
};

// Attention, convolutions and linear layers of a forward pass over a cloud at voxels [N,3], `repeats` times each, kind
// by kind of block; the best of each kind is summed.
KernelTimings TimeKernels(const std::vector<int32_t>& voxels, int repeats);

}  // namespace anchorsplat
