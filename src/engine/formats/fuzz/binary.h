#pragma once

#include <algorithm>
#include <cstring>
#include <string>
#include <string_view>

namespace anchorsplat {

// A binary file in either byte order.
class Binary {
 public:
  explicit Binary(bool big_endian) : big_endian_(big_endian) {}
  template <typename T>
  void Put(T value) {
    char raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof(T));
    if (big_endian_) std::reverse(raw, raw + sizeof(T));
    bytes_.append(raw, sizeof(T));
  }
  void Text(std::string_view text) { bytes_ += text; }
  const std::string& bytes() const { return bytes_; }

 private:
  bool big_endian_;
  std::string bytes_;
};

}  // namespace anchorsplat
