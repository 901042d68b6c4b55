#pragma once

#include <chrono>

namespace anchorsplat {

// Wall-clock time in seconds.
class Stopwatch {
 public:
  // Since the last lap or construction.
  double Lap() {
    const auto now = Clock::now();
    const double seconds = std::chrono::duration<double>(now - lap_).count();
    lap_ = now;
    return seconds;
  }
  // Since construction.
  double Total() const { return std::chrono::duration<double>(Clock::now() - begin_).count(); }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point begin_ = Clock::now();
  Clock::time_point lap_ = begin_;
};

}  // namespace anchorsplat
