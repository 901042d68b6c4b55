#pragma once

#include <filesystem>
#include <ostream>
#include <streambuf>
#include <string>

namespace anchorsplat {

// A name as it is shown within a line: bytes that are no UTF-8 or could command a terminal, line ends among them, are
// escaped.
std::string OneLine(const std::filesystem::path& name);

// While it lives, what is written to `stream` arrives line by line as Printable() shows it: results name files, folders
// and views, and quote what is in them, and none of that may command a terminal. Messages on stderr go through the same
// (core/log.cc). Only line ends pass; those in names are OneLine()'s business.
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

// JSON text in which nothing can command a terminal, nor is changed by CleanOutput: control characters above U+007E are
// written as \u00xx. They occur within strings only.
std::string CleanJson(const std::string& json);

}  // namespace anchorsplat
