#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace anchorsplat {

// Parses Java properties as java.util.Properties does: ISO-8859-1 with \uXXXX, `key=value`, `key: value` or `key
// value`, lines joined by a trailing backslash, comments after # or !. Results are UTF-8. Any text is valid.
struct JavaProperties {
  std::vector<std::pair<std::string, std::string>> entries;  // in the file's order
  std::string header;                                        // comment before the first property, without #

  // The last value of `key`, as in Java; "" if there is none.
  std::string Get(std::string_view key) const;
};

JavaProperties ParseJavaProperties(std::string_view text);

}  // namespace anchorsplat
