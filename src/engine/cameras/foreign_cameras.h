#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "io/json_file.h"

namespace anchorsplat {

// Files of cameras, and of whole projects, that other programs have and no reader here knows: "looks like …; what to
// export instead", the end of a sentence. Empty where it is none of them.

// By its name, and the first bytes where they are at hand.
std::string ForeignCameras(const std::filesystem::path& file, std::string_view head = {});
// By what is in it.
std::string ForeignJson(const JsonValue& root);
// The first file of a folder that is one, by name: its path and the same; empty where there is none.
std::string ForeignCamerasIn(const std::filesystem::path& folder);

}  // namespace anchorsplat
