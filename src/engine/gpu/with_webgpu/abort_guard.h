#pragma once

#include <functional>

namespace anchorsplat {

// Calls `library_call`; returns false if it ended in abort(), as wgpu-native does if a device is lost during
// submission. The library's locks are then held forever, so it must never be called again. Objects that need
// destruction must live outside of the call. Aborts of other threads still end the program.
bool SurvivesAbort(const std::function<void()>& library_call);

}  // namespace anchorsplat
