#include "io/json_file.h"

#include <cmath>
#include <new>
#include <utility>

#include "core/text.h"
#include "io/file_bytes.h"

namespace anchorsplat {

namespace {

constexpr uint64_t kMaxBytes = uint64_t{256} << 20;
constexpr size_t kMaxDepth = 64;
constexpr size_t kMaxValues = size_t{1} << 24;

// The library's message without its tags and long quotes of the text.
std::string SyntaxSentence(const std::string& what) {
  const size_t at = what.find("line ");
  std::string sentence = at == std::string::npos ? what : what.substr(at);
  if (sentence.size() > 200) sentence = sentence.substr(0, 200) + "…";
  return sentence;
}

// SAX handler that builds the document within the bounds. The library's parser with a callback rescans the enclosing
// array after every object: a minute for 200,000 of them.
class BoundedBuilder : public nlohmann::json_sax<nlohmann::json> {
 public:
  explicit BoundedBuilder(nlohmann::json& root) : root_(&root) {}

  const std::string& problem() const { return problem_; }

  bool null() override { return Put(nullptr) != nullptr; }
  bool boolean(bool value) override { return Put(value) != nullptr; }
  bool number_integer(number_integer_t value) override { return Put(value) != nullptr; }
  bool number_unsigned(number_unsigned_t value) override { return Put(value) != nullptr; }
  bool number_float(number_float_t value, const string_t&) override { return Put(value) != nullptr; }
  bool string(string_t& value) override { return Put(std::move(value)) != nullptr; }
  bool binary(binary_t& value) override { return Put(std::move(value)) != nullptr; }
  bool start_object(size_t) override { return Begin(nlohmann::json::object()); }
  bool start_array(size_t) override { return Begin(nlohmann::json::array()); }
  bool end_object() override { return End(); }
  bool end_array() override { return End(); }
  bool key(string_t& name) override {
    key_ = std::move(name);
    return true;
  }
  bool parse_error(size_t, const std::string&, const nlohmann::json::exception& error) override {
    problem_ = "not valid JSON: " + SyntaxSentence(error.what());
    return false;
  }

 private:
  // Stores a value and returns its location; null if there are too many.
  nlohmann::json* Put(nlohmann::json value) {
    if (++values_ > kMaxValues) {
      problem_ = Cat("more than ", WithThousands(kMaxValues), " values");
      return nullptr;
    }
    if (open_.empty()) {
      *root_ = std::move(value);
      return root_;
    }
    nlohmann::json& parent = *open_.back();
    if (parent.is_array()) return &parent.emplace_back(std::move(value));
    return &(parent[key_] = std::move(value));  // the last of duplicate members counts
  }
  bool Begin(nlohmann::json value) {
    if (open_.size() >= kMaxDepth) {
      problem_ = Cat("nested deeper than ", kMaxDepth);
      return false;
    }
    nlohmann::json* const place = Put(std::move(value));
    if (place != nullptr) open_.push_back(place);
    return place != nullptr;
  }
  bool End() {
    open_.pop_back();
    return true;
  }

  nlohmann::json* root_;
  std::vector<nlohmann::json*> open_;  // outermost first; only the innermost grows, so pointers stay valid
  std::string key_;                    // of the next member
  std::string problem_;
  size_t values_ = 0;
};

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

JsonValue JsonValue::Element(size_t index) const { return {*file_, (*value_)[index], Cat(path_, "[", index, "]")}; }

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
  try {
    BoundedBuilder builder(file.value_);
    if (!nlohmann::json::sax_parse(bytes, &builder)) {
      return Error{ErrorCode::kBadFile, Cat(file.name_, ": ", builder.problem())};
    }
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::kBadFile, Cat(file.name_, ": does not fit into memory")};
  }
  return file;
}

}  // namespace anchorsplat
