#pragma once

#include <atomic>
#include <mutex>
#include <string>

#include "core/result.h"

namespace anchorsplat {

inline constexpr const char* kGpuLost = "the device was lost while it worked";

// Whether a message of the library is about that; wgpu-native says so in every call that finds out.
bool SaysLost(const std::string& message);

// What a message of the library comes to: its last line that says something. "Validation Error", "Caused by:" and the
// name of the function stand above.
std::string ReasonIn(const std::string& message);

// The first failure of a device, told by whoever notices: calls of ours, or the library from whichever thread.
class GpuFailure {
 public:
  void Set(const std::string& sentence);
  bool happened() const { return happened_.load(std::memory_order_acquire); }
  Error error() const;

 private:
  mutable std::mutex mutex_;
  std::string sentence_;
  std::atomic<bool> happened_ = false;
};

}  // namespace anchorsplat
