#pragma once

#include <filesystem>
#include <string>

namespace anchorsplat {

// The last line of a process's log that says something: its error message. Empty where there is none.
std::string LastWords(const std::filesystem::path& log);

}  // namespace anchorsplat
