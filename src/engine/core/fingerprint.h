#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <span>
#include <string>

namespace anchorsplat {

// 64-bit FNV-1a over the bytes of arrays. Unlike std::hash it is the same in every run and on every machine of the same
// byte order. Detects change, not tampering.
class Fingerprint {
 public:
  // Each seed gives another hash; 0 is plain FNV-1a.
  explicit Fingerprint(uint64_t seed = 0) : value_(0xcbf29ce484222325u ^ seed) {}

  // Adds the bytes of a contiguous range of trivially copyable values.
  template <typename Values>
  void Add(const Values& values) {
    const auto* bytes = reinterpret_cast<const unsigned char*>(values.data());
    const size_t count = values.size() * sizeof(values[0]);
    for (size_t i = 0; i < count; ++i) value_ = (value_ ^ bytes[i]) * 0x100000001b3u;
  }

  // Adds 32-bit words instead of bytes: four times as fast, a different hash.
  void AddWords(std::span<const float> values) {
    for (const float value : values) value_ = (value_ ^ std::bit_cast<uint32_t>(value)) * 0x100000001b3u;
  }

  uint64_t value() const { return value_; }
  std::string text() const {  // 16 hexadecimal digits
    char digits[17];
    std::snprintf(digits, sizeof digits, "%016llx", static_cast<unsigned long long>(value_));
    return digits;
  }

 private:
  uint64_t value_;
};

}  // namespace anchorsplat
