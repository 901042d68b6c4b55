#pragma once

#include <string>
#include <vector>

namespace anchorsplat {

// Rows of text as aligned columns, two spaces apart: the first column left-aligned, the others right-aligned. The first
// row is the heading and gets a rule below it.
std::string FormatTable(const std::vector<std::vector<std::string>>& rows);

}  // namespace anchorsplat
