#pragma once

#include <ctime>

namespace anchorsplat {

// Processor time this thread has used, in seconds: differences say what a piece of work costs, whoever else is busy.
inline double ThreadSeconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace anchorsplat
