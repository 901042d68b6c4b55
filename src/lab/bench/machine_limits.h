#pragma once

#include <string>

namespace anchorsplat {

// What this machine can do at most with the threads it may use, measured now. A figure divided by such a limit of the
// same run says more than the figure: it survives another machine and a busy neighbour.
struct MachineLimits {
  int threads = 0;
  std::string instruction_set;  // that the kernels were dispatched to, Highway's name
  double fma_per_second = 0;    // single-precision multiply-adds, all lanes of all threads
  double bytes_per_second = 0;  // read from memory, all threads
};

// Takes about a third of a second and 256 MiB.
MachineLimits MeasureMachineLimits();

}  // namespace anchorsplat
