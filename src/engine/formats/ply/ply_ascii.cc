#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>
#include <type_traits>

#include "core/log.h"
#include "core/number_text.h"
#include "core/text.h"
#include "formats/ply/ply_rows.h"

namespace anchorsplat {

namespace {

// Reads words line by line.
class WordReader {
 public:
  WordReader(const InputFile& file, const PlyHeader& header)
      : file_(&file), reader_(file, header.body), line_(header.lines + 1) {}

  int64_t line() const { return line_; }
  // Moves to the next non-blank line. False at the end of the file.
  Result<bool> NextLine();
  // The next word of the line, valid until the next call; empty at the end of the line.
  Result<std::string_view> NextWord();

 private:
  static constexpr size_t kMaxWord = 64;  // enough for any number
  const InputFile* file_;
  SequentialReader reader_;
  int64_t line_;
  bool after_cr_ = false;
  char word_[kMaxWord];
};

Result<bool> WordReader::NextLine() {
  for (;;) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string_view text, reader_.Peek());
    if (text.empty()) return false;
    const char c = text.front();
    if (c == '\n') {
      if (!after_cr_) ++line_;
    } else if (c == '\r') {
      ++line_;
    } else if (c != ' ' && c != '\t') {
      return true;
    }
    after_cr_ = c == '\r';
    reader_.Consume(1);
  }
}

Result<std::string_view> WordReader::NextWord() {
  size_t size = 0;
  for (;;) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(std::string_view text, reader_.Peek());
    if (size == 0) {
      const size_t blanks = std::min(text.find_first_not_of(" \t"), text.size());
      reader_.Consume(blanks);
      text.remove_prefix(blanks);
      if (text.empty() && blanks > 0) continue;  // end of the block; try the next
    }
    const size_t end = std::min(text.find_first_of(" \t\r\n"), text.size());
    if (size + end > kMaxWord) {
      return Error{ErrorCode::kBadFile, Cat(file_->name(), ": line ", line_, ": expected a number, found \"",
                                            Printable(std::string(text.substr(0, kMaxWord))), "\"")};
    }
    std::memcpy(word_ + size, text.data(), end);
    size += end;
    reader_.Consume(end);
    if (end < text.size() || text.empty()) {
      after_cr_ = false;
      return std::string_view(word_, size);
    }
  }
}

// Integers may be written as "3.0"; values out of a double's range become ∞ or 0.
bool ParseDouble(std::string_view word, double& value) {
  if (!word.empty() && word.front() == '+') word.remove_prefix(1);
  const auto [end, error] = FromChars(word.data(), word.data() + word.size(), value);
  if (error == std::errc::invalid_argument || end != word.data() + word.size()) return false;
  if (error == std::errc::result_out_of_range) value = std::strtod(std::string(word).c_str(), nullptr);
  return true;
}

bool ParseFloat(std::string_view word, float& value) {
  if (!word.empty() && word.front() == '+') word.remove_prefix(1);
  const char* const end = word.data() + word.size();
  auto result = FromChars(word.data(), end, value);
  if (result.ec == std::errc::result_out_of_range) {
    // Out of a float's range: round like binary doubles, to infinity or zero.
    double wide = 0;
    result = FromChars(word.data(), end, wide);
    // Below a double's range: zero. A word is too short to get there without an exponent.
    const size_t exponent = std::min(word.find_first_of("eE"), word.size() - 1);
    if (result.ec == std::errc::result_out_of_range && word.substr(exponent + 1).starts_with('-')) {
      wide = word.front() == '-' ? -0.0 : 0.0;
      result.ec = std::errc{};
    }
    value = static_cast<float>(wide);
  }
  return result.ec == std::errc{} && result.ptr == end;
}

template <typename T>
bool ParseAs(std::string_view word, std::byte* out) {
  double number = 0;
  if (!ParseDouble(word, number)) return false;
  if (std::is_integral_v<T> && !(number >= double{std::numeric_limits<T>::min()} &&
                                 number <= double{std::numeric_limits<T>::max()} && number == std::floor(number))) {
    return false;
  }
  const T value = static_cast<T>(number);
  std::memcpy(out, &value, sizeof(T));
  return true;
}

// Stores the value of an extra property.
bool ParseBytes(std::string_view word, PlyType type, std::byte* out) {
  float value = 0;
  switch (type) {
    case PlyType::kInt8:
      return ParseAs<int8_t>(word, out);
    case PlyType::kUint8:
      return ParseAs<uint8_t>(word, out);
    case PlyType::kInt16:
      return ParseAs<int16_t>(word, out);
    case PlyType::kUint16:
      return ParseAs<uint16_t>(word, out);
    case PlyType::kInt32:
      return ParseAs<int32_t>(word, out);
    case PlyType::kUint32:
      return ParseAs<uint32_t>(word, out);
    case PlyType::kFloat:
      if (!ParseFloat(word, value)) return false;
      std::memcpy(out, &value, sizeof value);
      return true;
    case PlyType::kDouble:
      return ParseAs<double>(word, out);
  }
  return false;
}

class RowReader {
 public:
  RowReader(const InputFile& file, const PlyHeader& header) : file_(&file), words_(file, header) {}

  // Reads one row; calls `store(property, value)` for values with a destination.
  template <typename Store>
  Status Read(const PlyElement& element, int64_t row, const Store& store);
  // Line number of the next row; 0 at the end of the file.
  Result<int64_t> NextLine() {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const bool more, words_.NextLine());
    return more ? words_.line() : 0;
  }

 private:
  Error Bad(const std::string& what) const {
    return {ErrorCode::kBadFile, Cat(file_->name(), ": line ", WithThousands(words_.line()), ": ", what)};
  }
  Result<std::string_view> Word(const PlyElement& element, const PlyProperty& property);

  const InputFile* file_;
  WordReader words_;
};

Result<std::string_view> RowReader::Word(const PlyElement& element, const PlyProperty& property) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string_view word, words_.NextWord());
  if (!word.empty()) return word;
  return Bad(Cat("the line ends before property \"", Printable(property.name), "\" (expected ",
                 element.properties.size(), " properties of element \"", Printable(element.name), "\")"));
}

template <typename Store>
Status RowReader::Read(const PlyElement& element, int64_t row, const Store& store) {
  if (element.properties.empty()) return {};
  ANCHORSPLAT_ASSIGN_OR_RETURN(const bool more, words_.NextLine());
  if (!more) {
    return Bad(Cat("the file ends at row ", WithThousands(row), " of ", WithThousands(element.count), " of element \"",
                   Printable(element.name), "\""));
  }
  for (size_t p = 0; p < element.properties.size(); ++p) {
    const PlyProperty& property = element.properties[p];
    ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string_view word, Word(element, property));
    if (!property.list_count) {
      if (!store(p, word)) {
        return Bad(Cat("property \"", Printable(property.name), "\": expected a number, found \"",
                       Printable(std::string(word)), "\""));
      }
      continue;
    }
    int64_t count = 0;
    const auto [end, error] = FromChars(word.data(), word.data() + word.size(), count);
    if (error != std::errc{} || end != word.data() + word.size() || count < 0) {
      return Bad(Cat("list property \"", Printable(property.name), "\": expected a count, found \"",
                     Printable(std::string(word)), "\""));
    }
    for (int64_t k = 0; k < count; ++k) ANCHORSPLAT_RETURN_IF_ERROR(Word(element, property));
  }
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string_view extra, words_.NextWord());
  if (!extra.empty()) {
    return Bad(Cat("expected the end of the line after ", element.properties.size(), " properties, found \"",
                   Printable(std::string(extra)), "\""));
  }
  return {};
}

}  // namespace

Status ReadAsciiBody(const InputFile& file, const PlyHeader& header, const PlyElement& vertex,
                     const std::vector<PlyDestination>& to) {
  RowReader reader(file, header);
  for (const PlyElement& element : header.elements) {
    if (&element == &vertex) break;
    if (element.properties.empty()) continue;  // its rows have no text
    for (int64_t row = 0; row < element.count; ++row) {
      ANCHORSPLAT_RETURN_IF_ERROR(reader.Read(element, row, [](size_t, std::string_view) { return true; }));
    }
  }
  for (int64_t row = 0; row < vertex.count; ++row) {
    ANCHORSPLAT_RETURN_IF_ERROR(reader.Read(vertex, row, [&](size_t p, std::string_view word) {
      if (to[p].number != nullptr) return ParseFloat(word, to[p].number[row * to[p].stride]);
      if (to[p].wide != nullptr) {
        float rounded = 0;  // an overflow is not a number
        return ParseFloat(word, rounded) && ParseDouble(word, to[p].wide[row * to[p].stride]);
      }
      return to[p].bytes == nullptr || ParseBytes(word, vertex.properties[p].type, to[p].bytes + row * to[p].stride);
    }));
  }
  if (&header.elements.back() != &vertex) return {};
  ANCHORSPLAT_ASSIGN_OR_RETURN(const int64_t surplus, reader.NextLine());
  if (surplus > 0) {
    LogWarning(Cat(file.name(), ": line ", WithThousands(surplus), ": ignoring what follows its ",
                   WithThousands(vertex.count), " Gaussians, as the header does not mention it"));
  }
  return {};
}

}  // namespace anchorsplat
