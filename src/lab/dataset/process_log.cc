#include "dataset/process_log.h"

#include <string_view>

#include "core/text.h"
#include "io/file_bytes.h"

namespace anchorsplat {

std::string LastWords(const std::filesystem::path& log) {
  const auto text = ReadFileBytes(log, uint64_t{64} << 20);
  if (!text.ok()) return {};
  std::string_view rest = *text;
  while (!rest.empty() && (rest.back() == '\n' || rest.back() == '\r')) rest.remove_suffix(1);
  const size_t line = rest.rfind('\n');
  std::string words = Printable(std::string(line == std::string_view::npos ? rest : rest.substr(line + 1)), 1000);
  for (const std::string_view prefix : {"anchorsplat: ", "error: "}) {
    if (words.starts_with(prefix)) words.erase(0, prefix.size());
  }
  return words;
}

}  // namespace anchorsplat
