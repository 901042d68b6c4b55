#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <span>
#include <string>

namespace anchorsplat {

// FNV-1a of 64 bits over the bytes of arrays: the same number in every run and on every machine of the same byte order,
// unlike std::hash. It tells whether two things are the same where nobody means harm, and no more.
class Fingerprint {
 public:
  // A seed gives another number for the same bytes; 0 is FNV-1a itself.
  explicit Fingerprint(uint64_t seed = 0) : value_(0xcbf29ce484222325u ^ seed) {}

  // Any contiguous range of plain values.
  template <typename Values>
  void Add(const Values& values) {
    const auto* bytes = reinterpret_cast<const unsigned char*>(values.data());
    const size_t count = values.size() * sizeof(values[0]);
    for (size_t i = 0; i < count; ++i) value_ = (value_ ^ bytes[i]) * 0x100000001b3u;
  }

  // The same by words of 32 bits instead of bytes, four times as quick: another number.
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
