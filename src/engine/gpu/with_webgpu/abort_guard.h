#pragma once

#include <functional>

namespace anchorsplat {

// Calls `library_call` and returns true; false if it ended in abort(), which is what wgpu-native does where a device is
// lost while work is handed over. Its locks are then held for ever: nothing more of the library may be called. What the
// call has to destroy must be outside of it. Aborts of other threads end the program as ever.
bool SurvivesAbort(const std::function<void()>& library_call);

}  // namespace anchorsplat
