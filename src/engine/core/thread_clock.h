#pragma once

#include <ctime>

namespace anchorsplat {

// CPU time of the calling thread in seconds, which other load does not affect. Only differences have meaning.
inline double ThreadSeconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace anchorsplat
