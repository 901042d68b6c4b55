#include "formats/ply/ply_color_space.h"

#include <algorithm>
#include <string>
#include <string_view>

#include "core/number_text.h"
#include "core/text.h"
#include "core/words.h"

namespace anchorsplat {

namespace {

// The integer at byte `at` of the file.
Result<int> ByteAt(const InputFile& file, const PlyHeader& header, const PlyProperty& property, uint64_t at) {
  const auto size = static_cast<size_t>(PlyTypeSize(property.type));
  uint8_t bytes[8] = {};
  ANCHORSPLAT_RETURN_IF_ERROR(file.ReadAt(at, bytes, size));
  if (header.encoding == PlyEncoding::kBigEndian) std::reverse(bytes, bytes + size);
  const bool small = std::all_of(bytes + 1, bytes + size, [](uint8_t byte) { return byte == 0; });
  return small ? int{bytes[0]} : -1;
}

// The n-th last non-empty line of a text file. Elements after it have few rows.
Result<int> LineFromEnd(const InputFile& file, int64_t line) {
  constexpr uint64_t kTail = 1 << 16;
  const uint64_t size = std::min<uint64_t>(file.size(), kTail);
  std::string tail(static_cast<size_t>(size), '\0');
  ANCHORSPLAT_RETURN_IF_ERROR(file.ReadAt(file.size() - size, tail.data(), tail.size()));
  std::string_view rest = tail;
  while (!rest.empty()) {
    while (!rest.empty() && (rest.back() == '\n' || rest.back() == '\r' || rest.back() == ' ')) rest.remove_suffix(1);
    const size_t end = rest.find_last_of("\r\n");
    std::string_view text = end == rest.npos ? rest : rest.substr(end + 1);
    if (line-- == 0) {
      const std::string_view word = TakeWord(text);
      double value = -1;
      const auto [stop, code] = FromChars(word.data(), word.data() + word.size(), value);
      const bool good =
          code == std::errc() && stop == word.data() + word.size() && text.empty() && (value == 0 || value == 1);
      return good ? static_cast<int>(value) : -1;
    }
    rest = end == rest.npos ? std::string_view() : rest.substr(0, end);
  }
  return -1;
}

}  // namespace

Result<bool> HasLinearColors(const InputFile& file, const PlyHeader& header) {
  const PlyElement* const element = header.Find(kColorSpace);
  if (element == nullptr || element->count == 0) return false;
  const auto bad = [&](const std::string& what) {
    return Error{ErrorCode::kBadFile,
                 Cat(file.name(), ": line ", element->line, ": element \"", kColorSpace, "\" ", what)};
  };
  const bool one = element->count == 1 && element->properties.size() == 1 && !element->properties[0].list_count &&
                   element->properties[0].type < PlyType::kFloat;
  if (!one) return bad("is not one whole number, as SHARP writes it");
  int value = 0;
  if (header.encoding == PlyEncoding::kAscii) {
    int64_t behind = 0;
    for (auto other = header.elements.rbegin(); &*other != element; ++other) behind += other->count;
    ANCHORSPLAT_ASSIGN_OR_RETURN(value, LineFromEnd(file, behind));
  } else {
    uint64_t at = header.body;
    for (const PlyElement& other : header.elements) {
      if (&other == element) break;
      if (other.has_lists()) return bad("comes after lists, where it cannot be read");
      if (static_cast<uint64_t>(other.count) > file.size() / std::max<uint64_t>(1, other.row_size())) {
        return bad("lies beyond the end of the file");
      }
      at += static_cast<uint64_t>(other.count) * other.row_size();
    }
    ANCHORSPLAT_ASSIGN_OR_RETURN(value, ByteAt(file, header, element->properties[0], at));
  }
  if (value != 0 && value != 1) return bad("is unknown (0 is sRGB, 1 linear RGB)");
  return value == 1;
}

}  // namespace anchorsplat
