#pragma once

#include <span>
#include <string>

#include "core/camera.h"

namespace anchorsplat {

// A transforms.json holds camera-to-world matrices in OpenGL's axes; some programs write OpenCV's, and every camera
// then looks the other way. What speaks for that, as the end of a sentence that says what to do; empty where nothing
// does. `points` [N,3], world: what the cameras are to see, where it is known. Without it, cameras that all look away
// from the point that their views' axes meet in are suspicious; those of a room, with z up as they should have it, are
// not.
std::string WrongAxes(const CameraSet& set, std::span<const float> points);

}  // namespace anchorsplat
