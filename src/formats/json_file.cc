#include "formats/json_file.h"

#include <cmath>
#include <exception>
#include <new>

#include "core/text.h"
#include "formats/file_bytes.h"

namespace anchorsplat {

namespace {

constexpr uint64_t kMaxBytes = uint64_t{256} << 20;
constexpr int kMaxDepth = 64;
constexpr size_t kMaxValues = size_t{1} << 24;

struct TooMuch : std::exception {
  explicit TooMuch(std::string text) : sentence(std::move(text)) {}
  const char* what() const noexcept override { return sentence.c_str(); }
  std::string sentence;
};

// The library's sentence without its own tags. It quotes the text it stumbled over, which may be long.
std::string SyntaxSentence(const std::string& what) {
  const size_t at = what.find("line ");
  std::string sentence = at == std::string::npos ? what : what.substr(at);
  if (sentence.size() > 200) sentence = sentence.substr(0, 200) + "…";
  return sentence;
}

}  // namespace

Error JsonValue::Complain(const std::string& sentence) const {
  return Error{ErrorCode::kBadFile, Cat(*file_, ": ", path_, path_.empty() ? "" : ": ", sentence)};
}

Error JsonValue::Named(const Error& error, const char* key) const {
  const auto name = Find(key);
  if (!name || !name->value_->is_string()) return error;
  return Error{error.code, Cat(error.message, " (view ", Printable(name->value_->get<std::string>()), ")")};
}

std::optional<JsonValue> JsonValue::Find(const char* key) const {
  if (!value_->is_object()) return std::nullopt;
  const auto member = value_->find(key);
  if (member == value_->end()) return std::nullopt;
  return JsonValue(*file_, *member, path_.empty() ? key : Cat(path_, ".", key));
}

Result<JsonValue> JsonValue::Get(const char* key) const {
  if (!value_->is_object()) return Complain(Cat("expected an object, found ", value_->type_name()));
  if (auto member = Find(key)) return *std::move(member);
  return Complain(Cat("\"", key, "\" is missing"));
}

Result<std::vector<JsonValue>> JsonValue::Elements() const {
  if (!value_->is_array()) return Complain(Cat("expected an array, found ", value_->type_name()));
  std::vector<JsonValue> elements;
  elements.reserve(value_->size());
  for (size_t i = 0; i < value_->size(); ++i) elements.emplace_back(*file_, (*value_)[i], Cat(path_, "[", i, "]"));
  return elements;
}

Result<double> JsonValue::Number() const {
  if (!value_->is_number()) return Complain(Cat("expected a number, found ", value_->type_name()));
  return value_->get<double>();
}

Result<std::vector<double>> JsonValue::Numbers(size_t count) const {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::vector<JsonValue> elements, Elements());
  if (elements.size() != count) return Complain(Cat("expected ", count, " numbers, found ", elements.size()));
  std::vector<double> numbers;
  for (const JsonValue& element : elements) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const double number, element.Number());
    numbers.push_back(number);
  }
  return numbers;
}

Result<int> JsonValue::WholeNumber(int min, int max) const {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const double number, Number());
  if (number != std::floor(number) || number < min || number > max) {
    return Complain(Cat("expected a whole number from ", min, " to ", max, ", found ", number));
  }
  return static_cast<int>(number);
}

Result<std::string> JsonValue::Text() const {
  if (!value_->is_string()) return Complain(Cat("expected a string, found ", value_->type_name()));
  return value_->get<std::string>();
}

Result<JsonFile> JsonFile::Read(const std::filesystem::path& path) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(const std::string bytes, ReadFileBytes(path, kMaxBytes));
  return Parse(path.string(), bytes);
}

Result<JsonFile> JsonFile::Parse(std::string name, std::string_view bytes) {
  JsonFile file;
  file.name_ = std::move(name);
  size_t values = 0;
  const auto bounded = [&values](int depth, nlohmann::json::parse_event_t event, nlohmann::json&) {
    using Event = nlohmann::json::parse_event_t;
    if (depth > kMaxDepth) throw TooMuch(Cat("nested deeper than ", kMaxDepth));
    const bool begins = event == Event::value || event == Event::array_start || event == Event::object_start;
    if (begins && ++values > kMaxValues) throw TooMuch(Cat("more than ", WithThousands(kMaxValues), " values"));
    return true;
  };
  try {
    file.value_ = nlohmann::json::parse(bytes, bounded);
  } catch (const nlohmann::json::exception& e) {
    return Error{ErrorCode::kBadFile, Cat(file.name_, ": not valid JSON: ", SyntaxSentence(e.what()))};
  } catch (const TooMuch& e) {
    return Error{ErrorCode::kBadFile, Cat(file.name_, ": ", e.sentence)};
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::kBadFile, Cat(file.name_, ": does not fit into memory")};
  }
  return file;
}

}  // namespace anchorsplat
