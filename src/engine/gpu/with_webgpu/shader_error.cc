#include "gpu/with_webgpu/shader_error.h"

#include <algorithm>
#include <charconv>
#include <system_error>

#include "core/text.h"
#include "gpu/with_webgpu/gpu_failure.h"

namespace anchorsplat {

namespace {

std::string Trimmed(std::string_view line) {
  const size_t first = std::min(line.find_first_not_of(" \t"), line.size());
  const size_t last = line.find_last_not_of(" \t\r\n");
  return last == std::string_view::npos || last < first ? "" : std::string(line.substr(first, last - first + 1));
}

std::string LineOf(std::string_view text, size_t number) {
  for (size_t at = 0; at < text.size();) {
    const size_t end = std::min(text.find('\n', at), text.size());
    if (--number == 0) return Trimmed(text.substr(at, end - at));
    at = end + 1;
  }
  return {};
}

// The line number 3 in ":3:5"; 0 if there is none.
size_t LineNumberIn(std::string_view message) {
  for (size_t at = message.find(':'); at != std::string_view::npos; at = message.find(':', at + 1)) {
    size_t number = 0;
    const char* const end = message.data() + message.size();
    const auto [after, error] = std::from_chars(message.data() + at + 1, end, number);
    if (error == std::errc() && end - after >= 2 && after[0] == ':' && after[1] >= '0' && after[1] <= '9')
      return number;
  }
  return 0;
}

// The text after the last "error:", else the last line with content.
std::string WordsIn(std::string_view message) {
  constexpr std::string_view kMark = "error:";
  if (const size_t mark = message.rfind(kMark); mark != std::string_view::npos) {
    message.remove_prefix(mark + kMark.size());
    return Trimmed(message.substr(0, message.find('\n')));
  }
  return ReasonOf(std::string(message));
}

}  // namespace

std::string ShaderError(const std::string& message, std::string_view text) {
  // naga: "error: no definition in scope for identifier: `y`" above "wgsl:3:5"; Tint: ":3:5 error: unresolved value
  // 'y'".
  const std::string words = Printable(WordsIn(message), 200);
  const size_t number = LineNumberIn(message);
  if (number == 0) return words;
  return Cat(words, " in line ", number, ", '", Printable(LineOf(text, number), 120), "'");
}

}  // namespace anchorsplat
