#pragma once

#include <atomic>
#include <mutex>
#include <string>

#include "core/result.h"

namespace anchorsplat {

inline constexpr const char* kGpuLost = "the device was lost while it worked";

// Whether a library message reports a lost device; wgpu-native does so in every affected call.
bool IsDeviceLost(const std::string& message);

// The reason in a library message: its last line with content, below "Validation Error", "Caused by:" and the function
// name.
std::string ReasonOf(const std::string& message);

// The first failure of a device, from our calls or from library callbacks on any thread.
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
