#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "core/camera.h"

namespace anchorsplat {

// Appends a text that changes when the inputs of a result do. Files count by name, size and modification time, so
// nothing
// is read.
void AddFileState(std::string& state, const std::filesystem::path& file);
void AddCameraState(std::string& state, std::span<const Camera> cameras);  // including their pictures

// Fingerprint of cameras and their pictures.
std::string CamerasState(std::span<const Camera> cameras);

}  // namespace anchorsplat
