#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace anchorsplat {

// A file of Java properties as java.util.Properties reads it: ISO-8859-1 with \uXXXX, `key=value`, `key: value` or
// `key value`, lines joined by a backslash at their end, comments after # or !. Everything comes out as UTF-8.
// There is no wrong file: any text is some list of properties.
struct JavaProperties {
  std::vector<std::pair<std::string, std::string>> entries;  // in the file's order
  std::string header;                                        // the comment before the first property, without #

  // The last value of `key`, as Java has it; "" when there is none.
  std::string Get(std::string_view key) const;
};

JavaProperties ParseJavaProperties(std::string_view text);

}  // namespace anchorsplat
