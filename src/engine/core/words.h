#pragma once

#include <string_view>

namespace anchorsplat {

// Splits lines of text files into words. Blanks are spaces, tabs and carriage returns.

inline bool IsBlank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

inline std::string_view Trimmed(std::string_view text) {
  while (!text.empty() && IsBlank(text.front())) text.remove_prefix(1);
  while (!text.empty() && IsBlank(text.back())) text.remove_suffix(1);
  return text;
}

// Removes and returns the first word of `line` and trims the rest; empty if there is none.
inline std::string_view TakeWord(std::string_view& line) {
  line = Trimmed(line);
  size_t end = 0;
  while (end < line.size() && !IsBlank(line[end])) ++end;
  const std::string_view word = line.substr(0, end);
  line = Trimmed(line.substr(end));
  return word;
}

}  // namespace anchorsplat
