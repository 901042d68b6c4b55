#pragma once

#include <string>

namespace anchorsplat {

inline constexpr const char* kReady = "ready";
inline constexpr const char* kMissing = "missing";  // an extra that was not asked for when this was built or set up
inline constexpr const char* kBroken = "broken";    // is there and does not work

// One line of `doctor`.
struct Finding {
  std::string name;
  const char* state = kReady;
  std::string text;     // more lines where there is more to say
  std::string command;  // gets what is missing; else empty
};

}  // namespace anchorsplat
