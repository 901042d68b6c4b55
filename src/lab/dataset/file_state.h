#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "core/camera.h"

namespace anchorsplat {

// What results are made from, as text that changes with it. Files count by name, size and time of their last change, so
// that nothing has to be read.
void AddFileState(std::string& state, const std::filesystem::path& file);
void AddCameraState(std::string& state, std::span<const Camera> cameras);  // and of their pictures

// A word for cameras and their pictures.
std::string CamerasState(std::span<const Camera> cameras);

}  // namespace anchorsplat
