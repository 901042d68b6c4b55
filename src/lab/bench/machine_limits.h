#pragma once

#include <string>

namespace anchorsplat {

// Peak performance of this machine with the allowed threads, measured now. A result relative to a limit from the same
// run holds on other machines and with busy neighbours.
struct MachineLimits {
  int threads = 0;
  std::string instruction_set;  // in use, Highway's name
  double fma_per_second = 0;    // single-precision multiply-adds, all lanes and threads
  double bytes_per_second = 0;  // memory reads, all threads
};

// Takes about a third of a second and 256 MiB.
MachineLimits MeasureMachineLimits();

}  // namespace anchorsplat
