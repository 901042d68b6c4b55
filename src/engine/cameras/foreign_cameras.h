#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "io/json_file.h"

namespace anchorsplat {

// Recognises camera and project files of other programs that have no reader here. Results are the end of a sentence,
// "looks like …; what to export instead"; empty if unknown.
//
// By name, and by first bytes if given.

// By its name, and the first bytes where they are at hand.
std::string ForeignCameras(const std::filesystem::path& file, std::string_view head = {});
// By content.
std::string ForeignJson(const JsonValue& root);
// The first such file in a folder, by name: its path and the same text; empty if there is none.
std::string ForeignCamerasIn(const std::filesystem::path& folder);

}  // namespace anchorsplat
