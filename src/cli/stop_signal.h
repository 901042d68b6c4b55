#pragma once

#include <atomic>

namespace anchorsplat {

// While the object lives, Ctrl-C and SIGTERM ask for an orderly end: requested() becomes true. The second one ends the
// program at once. One at a time.
class StopSignal {
 public:
  StopSignal();
  ~StopSignal();
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;

  static const std::atomic<bool>& requested();
};

}  // namespace anchorsplat
