#pragma once

#include <filesystem>
#include <string>

namespace anchorsplat {

// The last non-empty line of a process's log, its error message; empty if there is none.
std::string LastWords(const std::filesystem::path& log);

}  // namespace anchorsplat
