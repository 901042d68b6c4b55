#pragma once

#include <chrono>

namespace anchorsplat {

// Seconds on the clock.
class Stopwatch {
 public:
  // Since the last lap, or since the beginning.
  double Lap() {
    const auto now = Clock::now();
    const double seconds = std::chrono::duration<double>(now - lap_).count();
    lap_ = now;
    return seconds;
  }
  // Since the beginning.
  double Total() const { return std::chrono::duration<double>(Clock::now() - begin_).count(); }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point begin_ = Clock::now();
  Clock::time_point lap_ = begin_;
};

}  // namespace anchorsplat
