#include "scene/java_properties.h"

#include <cstddef>
#include <cstdint>

namespace anchorsplat {

namespace {

bool IsBlank(char c) { return c == ' ' || c == '\t' || c == '\f'; }

void AppendUtf8(uint32_t code, std::string& out) {
  if (code < 0x80) {
    out += static_cast<char>(code);
  } else if (code < 0x800) {
    out += static_cast<char>(0xc0 | code >> 6);
    out += static_cast<char>(0x80 | (code & 0x3f));
  } else if (code < 0x10000) {
    out += static_cast<char>(0xe0 | code >> 12);
    out += static_cast<char>(0x80 | (code >> 6 & 0x3f));
    out += static_cast<char>(0x80 | (code & 0x3f));
  } else {
    out += static_cast<char>(0xf0 | code >> 18);
    out += static_cast<char>(0x80 | (code >> 12 & 0x3f));
    out += static_cast<char>(0x80 | (code >> 6 & 0x3f));
    out += static_cast<char>(0x80 | (code & 0x3f));
  }
}

// Value of four hexadecimal digits at `at`; −1 if invalid.
int32_t HexUnit(std::string_view text, size_t at) {
  if (at + 4 > text.size()) return -1;
  int32_t value = 0;
  for (size_t k = at; k < at + 4; ++k) {
    const char c = text[k];
    const int digit = c >= '0' && c <= '9'   ? c - '0'
                      : c >= 'a' && c <= 'f' ? c - 'a' + 10
                      : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                             : -1;
    if (digit < 0) return -1;
    value = value * 16 + digit;
  }
  return value;
}

// Resolves escapes and converts Latin-1 to UTF-8. A lone surrogate becomes the replacement character.
std::string Unescaped(std::string_view text) {
  std::string out;
  for (size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '\\' || i + 1 == text.size()) {
      AppendUtf8(static_cast<uint8_t>(text[i]), out);
      continue;
    }
    const char c = text[++i];
    if (c == 'u') {
      const int32_t unit = HexUnit(text, i + 1);
      if (unit < 0) {
        out += 'u';
        continue;
      }
      i += 4;
      uint32_t code = static_cast<uint32_t>(unit);
      if (code >= 0xd800 && code < 0xe000) {
        const int32_t low = code < 0xdc00 && text.substr(i + 1, 2) == "\\u" ? HexUnit(text, i + 3) : -1;
        if (low >= 0xdc00 && low < 0xe000) {
          code = 0x10000 + ((code & 0x3ff) << 10) + (static_cast<uint32_t>(low) & 0x3ff);
          i += 6;
        } else {
          code = 0xfffd;
        }
      }
      AppendUtf8(code, out);
    } else {
      AppendUtf8(c == 't' ? '\t' : c == 'n' ? '\n' : c == 'r' ? '\r' : c == 'f' ? '\f' : static_cast<uint8_t>(c), out);
    }
  }
  return out;
}

// Returns the next line without its end and moves `at` behind it.
std::string_view NextLine(std::string_view text, size_t& at) {
  const size_t begin = at;
  const size_t end = text.find_first_of("\r\n", begin);
  if (end == std::string_view::npos) {
    at = text.size();
    return text.substr(begin);
  }
  at = end + (text[end] == '\r' && end + 1 < text.size() && text[end + 1] == '\n' ? 2 : 1);
  return text.substr(begin, end - begin);
}

std::string_view WithoutLeadingBlanks(std::string_view line) {
  while (!line.empty() && IsBlank(line.front())) line.remove_prefix(1);
  return line;
}

// An odd number of backslashes at the end joins the next line.
bool Continues(std::string_view line) {
  size_t count = 0;
  while (count < line.size() && line[line.size() - 1 - count] == '\\') ++count;
  return count % 2 == 1;
}

}  // namespace

JavaProperties ParseJavaProperties(std::string_view text) {
  JavaProperties out;
  for (size_t at = 0; at < text.size();) {
    std::string_view line = WithoutLeadingBlanks(NextLine(text, at));
    if (line.empty()) continue;
    if (line[0] == '#' || line[0] == '!') {
      if (out.entries.empty()) {
        // Comments have no escapes; only the encoding is converted.
        for (const char c : WithoutLeadingBlanks(line.substr(1))) AppendUtf8(static_cast<uint8_t>(c), out.header);
        out.header += '\n';
      }
      continue;
    }
    std::string logical(line);
    while (Continues(logical) && at < text.size()) {
      logical.pop_back();
      logical += WithoutLeadingBlanks(NextLine(text, at));
    }
    size_t key_end = 0;
    while (key_end < logical.size()) {
      const char c = logical[key_end];
      if (c == '=' || c == ':' || IsBlank(c)) break;
      key_end += c == '\\' ? 2 : 1;
    }
    key_end = key_end < logical.size() ? key_end : logical.size();
    std::string_view value = WithoutLeadingBlanks(std::string_view(logical).substr(key_end));
    if (!value.empty() && (value[0] == '=' || value[0] == ':')) value = WithoutLeadingBlanks(value.substr(1));
    out.entries.emplace_back(Unescaped(std::string_view(logical).substr(0, key_end)), Unescaped(value));
  }
  return out;
}

std::string JavaProperties::Get(std::string_view key) const {
  for (size_t i = entries.size(); i-- > 0;) {
    if (entries[i].first == key) return entries[i].second;
  }
  return {};
}

}  // namespace anchorsplat
