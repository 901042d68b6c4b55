#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace anchorsplat {

// Columns that `text` takes on a terminal.
size_t DisplayWidth(std::string_view text);

// Rows of text as aligned columns, two spaces apart: the first column left-aligned, the others right-aligned. The first
// row is the heading, with a rule below it. Line ends and terminal controls in cells are escaped.
std::string FormatTable(std::vector<std::vector<std::string>> rows);

}  // namespace anchorsplat
