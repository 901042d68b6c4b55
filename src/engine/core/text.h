#pragma once

#include <cstdint>
#include <sstream>
#include <string>
#include <utility>

namespace anchorsplat {

// Concatenates all arguments with operator<<: Cat("byte ", 17, ": bad").
template <typename... Args>
std::string Cat(const Args&... args) {
  std::ostringstream out;
  (out << ... << args);
  return std::move(out).str();
}

std::string WithThousands(int64_t n);         // 1,234,567
std::string Fixed(double value, int digits);  // Fixed(3.14159, 2) = "3.14"; "inf", "nan" as such
std::string HumanBytes(uint64_t bytes);       // powers of 1000
std::string HumanSeconds(double seconds);     // "850 ms", "12.3 s", "4 min 05 s"
std::string Printable(const std::string& bytes,
                      size_t longest = 60);  // for messages: escapes control characters and invalid UTF-8

}  // namespace anchorsplat
