#pragma once

#include <span>
#include <string>

#include "core/camera.h"

namespace anchorsplat {

// Detects a transforms.json with OpenCV camera-to-world matrices instead of OpenGL ones, which turn every camera
// around. Returns the evidence and what to do, as the end of a sentence; empty if there is none. `points` [N,3], world:
// scene points, if known. Without them, cameras are suspicious if all face away from the point nearest to their viewing
// axes; indoor captures with z up, as is correct, are not.
std::string WrongAxes(const CameraSet& set, std::span<const float> points);

}  // namespace anchorsplat
