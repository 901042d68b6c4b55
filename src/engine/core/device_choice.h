#pragma once

#include <string>
#include <string_view>

#include "core/result.h"

namespace anchorsplat {

// Where rasterizing and what belongs to it is calculated: cpu, gpu, auto or the number of an adapter.
struct DeviceChoice {
  enum class Kind { kCpu, kGpu, kAuto, kNumber };
  Kind kind = Kind::kCpu;
  int number = 0;  // of kNumber

  friend bool operator==(const DeviceChoice&, const DeviceChoice&) = default;
};

// "cpu", "gpu", "auto" or a whole number from 0 on. Error (kBadArgument): anything else.
Result<DeviceChoice> ParseDeviceChoice(std::string_view word);
std::string DeviceWord(const DeviceChoice& choice);  // its inverse

}  // namespace anchorsplat
