#pragma once

#include <string>
#include <string_view>

#include "core/result.h"

namespace anchorsplat {

// Where the rasterizer and related kernels run: on the CPU, a GPU, a GPU if there is one, or the adapter of that
// number.
struct DeviceChoice {
  enum class Kind { kCpu, kGpu, kAuto, kNumber };
  Kind kind = Kind::kCpu;
  int number = 0;  // adapter number, for kNumber

  friend bool operator==(const DeviceChoice&, const DeviceChoice&) = default;
};

// Parses "cpu", "gpu", "auto" or a whole number ≥ 0. Error (kBadArgument): anything else.
Result<DeviceChoice> ParseDeviceChoice(std::string_view word);
std::string DeviceWord(const DeviceChoice& choice);  // inverse of ParseDeviceChoice

}  // namespace anchorsplat
