#pragma once

#include <span>
#include <string>
#include <vector>

namespace anchorsplat {

// The names of views or paths of their pictures in parts: ViewName without ".", ".." and empty ones. {"cam0", "0000"}.
std::vector<std::string> ViewParts(const std::string& name);

// How views are called among each other: by the last part of their names where that tells them apart, else by all parts
// but the folders that all have in common ("cam0/0000"). Names that are the same stay so.
std::vector<std::string> ViewLabels(std::span<const std::string> names);

}  // namespace anchorsplat
