#include "cli/table.h"

#include <algorithm>

#include "cli/clean_output.h"

namespace anchorsplat {

// UTF-8 continuation bytes take no column.
size_t DisplayWidth(std::string_view text) {
  return static_cast<size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

std::string FormatTable(std::vector<std::vector<std::string>> rows) {
  for (auto& row : rows) {
    for (std::string& cell : row) cell = OneLine(cell);  // names of files and views may hold anything
  }
  std::vector<size_t> widths;
  for (const auto& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], DisplayWidth(row[c]));
  }
  std::string out;
  for (size_t r = 0; r < rows.size(); ++r) {
    for (size_t c = 0; c < rows[r].size(); ++c) {
      const std::string pad(widths[c] - DisplayWidth(rows[r][c]), ' ');
      const bool last = c + 1 == rows[r].size();
      if (c > 0) out += "  " + pad + rows[r][c];
      if (c == 0) out += rows[r][c] + (last ? "" : pad);
    }
    out += '\n';
    if (r == 0) {
      size_t total = 0;
      for (const size_t w : widths) total += w + 2;
      out += std::string(total - 2, '-') + '\n';
    }
  }
  return out;
}

}  // namespace anchorsplat
