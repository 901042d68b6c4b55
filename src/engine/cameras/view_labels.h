#pragma once

#include <span>
#include <string>
#include <vector>

namespace anchorsplat {

// Splits a view name or image path into ViewName components, without "." and "..": {"cam0", "0000"}.
std::vector<std::string> ViewParts(const std::string& name);

// Shortest labels: the last component if that is unique, else all components except the folders common to all
// ("cam0/0000"). Equal names get equal labels.
std::vector<std::string> ViewLabels(std::span<const std::string> names);

}  // namespace anchorsplat
