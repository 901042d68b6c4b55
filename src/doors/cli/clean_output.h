#pragma once

#include <filesystem>
#include <ostream>
#include <streambuf>
#include <string>

namespace anchorsplat {

// A name for display within a line: escapes line ends, terminal controls and bytes that are not UTF-8.
std::string OneLine(const std::filesystem::path& name);

// During its lifetime, text written to `stream` passes through Printable() line by line, so that names and quoted file
// contents cannot control the terminal. Messages on stderr do the same (core/log.cc). Line ends pass; use OneLine() for
// names.
class CleanOutput : private std::streambuf {
 public:
  explicit CleanOutput(std::ostream& stream);
  ~CleanOutput() override;
  CleanOutput(const CleanOutput&) = delete;
  CleanOutput& operator=(const CleanOutput&) = delete;

 private:
  int_type overflow(int_type byte) override;
  std::streamsize xsputn(const char* bytes, std::streamsize count) override;
  int sync() override;
  bool Emit(size_t bytes);  // the first bytes of what is held

  std::ostream& stream_;
  std::streambuf* target_;
  std::string held_;  // of the line that is not whole yet
};

// JSON text that cannot control a terminal and that CleanOutput leaves unchanged: control characters above U+007E,
// which occur only in strings, become \u00xx.
std::string CleanJson(const std::string& json);

}  // namespace anchorsplat
