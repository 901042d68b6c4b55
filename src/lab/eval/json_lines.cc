#include "eval/json_lines.h"

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <string_view>

#include "core/text.h"
#include "io/inflating_reader.h"
#include "io/input_file.h"

namespace anchorsplat {

namespace {

using nlohmann::json;

constexpr size_t kMostBytes = size_t{1} << 28;

Result<std::string> ReadText(const std::filesystem::path& path) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const InputFile file, InputFile::Open(path));
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string head, file.Head(2));
  const std::unique_ptr<InflatingReader> reader = head == "\x1f\x8b" ? OpenGzip(file, 0) : OpenPlain(file, 0);
  std::string text;
  for (std::string block(size_t{1} << 20, '\0');;) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const size_t count, reader->ReadSome(block.data(), block.size()));
    if (count == 0) return text;
    if (text.size() + count > kMostBytes) {
      return Error{ErrorCode::kBadFile, Cat(path.string(), ": larger than ", HumanBytes(kMostBytes))};
    }
    text.append(block, 0, count);
  }
}

}  // namespace

Status ForEachJsonLine(const std::filesystem::path& path,
                       const std::function<std::string(const json&, int64_t line)>& take) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string text, ReadText(path));
  int64_t line = 0;
  for (size_t at = 0; at < text.size();) {
    const size_t end = std::min(text.find('\n', at), text.size());
    ++line;
    const std::string_view words = std::string_view(text).substr(at, end - at);
    at = end + 1;
    if (words.find_first_not_of(" \t\r") == std::string_view::npos) continue;
    std::string wrong;
    const json object = json::parse(words, nullptr, /*allow_exceptions=*/false);
    if (!object.is_object()) {
      wrong = "not a JSON object";
    } else {
      try {
        wrong = take(object, line);
      } catch (const json::exception&) {
        wrong = "a property is missing or has a value of another type";
      }
    }
    if (!wrong.empty()) return Error{ErrorCode::kBadFile, Cat(path.string(), ": line ", line, ": ", wrong)};
  }
  return {};
}

}  // namespace anchorsplat
