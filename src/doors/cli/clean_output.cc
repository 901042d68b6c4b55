#include "cli/clean_output.h"

#include <algorithm>
#include <cstdio>
#include <limits>

#include "core/text.h"

namespace anchorsplat {

namespace {
constexpr size_t kWhole = std::numeric_limits<size_t>::max();
}  // namespace

std::string OneLine(const std::filesystem::path& name) { return Printable(name.string(), kWhole); }

CleanOutput::CleanOutput(std::ostream& stream) : stream_(stream), target_(stream.rdbuf(this)) {}

CleanOutput::~CleanOutput() {
  CleanOutput::sync();
  stream_.rdbuf(target_);
}

CleanOutput::int_type CleanOutput::overflow(int_type byte) {
  if (traits_type::eq_int_type(byte, traits_type::eof())) return traits_type::not_eof(byte);
  const char c = traits_type::to_char_type(byte);
  return xsputn(&c, 1) == 1 ? byte : traits_type::eof();
}

std::streamsize CleanOutput::xsputn(const char* bytes, std::streamsize count) {
  held_.append(bytes, static_cast<size_t>(count));
  const size_t end = held_.rfind('\n');
  return end == std::string::npos || Emit(end + 1) ? count : 0;
}

int CleanOutput::sync() { return Emit(held_.size()) && target_->pubsync() == 0 ? 0 : -1; }

bool CleanOutput::Emit(size_t bytes) {
  std::string clean;
  size_t at = 0;
  while (at < bytes) {
    const size_t end = std::min(held_.find('\n', at), bytes);
    clean += Printable(held_.substr(at, end - at), kWhole);
    if (end < bytes) clean += '\n';
    at = end + 1;
  }
  held_.erase(0, bytes);
  const auto size = static_cast<std::streamsize>(clean.size());
  return target_->sputn(clean.data(), size) == size;
}

std::string CleanJson(const std::string& json) {
  std::string out;
  out.reserve(json.size());
  for (size_t k = 0; k < json.size(); ++k) {
    const auto byte = static_cast<unsigned char>(json[k]);
    const unsigned char next = k + 1 < json.size() ? static_cast<unsigned char>(json[k + 1]) : 0;
    const bool two = byte == 0xc2 && next >= 0x80 && next < 0xa0;  // U+0080 to U+009F
    if (!two && byte != 0x7f) {
      out += json[k];
      continue;
    }
    char escaped[8];
    std::snprintf(escaped, sizeof escaped, "\\u%04x", two ? next : byte);
    out += escaped;
    if (two) ++k;
  }
  return out;
}

}  // namespace anchorsplat
