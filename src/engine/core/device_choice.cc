#include "core/device_choice.h"

#include <charconv>

#include "core/text.h"

namespace anchorsplat {

Result<DeviceChoice> ParseDeviceChoice(std::string_view word) {
  if (word == "cpu") return DeviceChoice{DeviceChoice::Kind::kCpu};
  if (word == "gpu") return DeviceChoice{DeviceChoice::Kind::kGpu};
  if (word == "auto") return DeviceChoice{DeviceChoice::Kind::kAuto};
  int number = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
  if (error == std::errc() && end == word.data() + word.size() && number >= 0) {
    return DeviceChoice{DeviceChoice::Kind::kNumber, number};
  }
  return Error{ErrorCode::kBadArgument,
               Cat("'", word, "' is not cpu, gpu, auto or the number of an adapter; anchorsplat doctor lists them")};
}

std::string DeviceWord(const DeviceChoice& choice) {
  switch (choice.kind) {
    case DeviceChoice::Kind::kGpu:
      return "gpu";
    case DeviceChoice::Kind::kAuto:
      return "auto";
    case DeviceChoice::Kind::kNumber:
      return Cat(choice.number);
    case DeviceChoice::Kind::kCpu:
      break;
  }
  return "cpu";
}

}  // namespace anchorsplat
