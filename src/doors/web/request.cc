#include "web/request.h"

#include "core/text.h"

namespace anchorsplat::web {

Error BadRequest(const std::string& what) { return {ErrorCode::kBadArgument, Cat("the request ", what)}; }

const Json* Find(const Json& request, const char* key) {
  const auto found = request.find(key);
  return found == request.end() || found->is_null() ? nullptr : &*found;
}

std::string TextOf(const Json& request, const char* key) {
  const Json* const value = Find(request, key);
  return value != nullptr && value->is_string() ? value->get<std::string>() : "";
}

Result<int64_t> NumberOf(const Json& request, const char* key, int64_t most) {
  const Json* const value = Find(request, key);
  if (value == nullptr) return int64_t{0};
  if (!value->is_number()) return BadRequest(Cat("has a '", key, "' that is not a number"));
  const auto number = value->get<double>();
  if (!(number >= 0 && number <= static_cast<double>(most)) ||
      number != static_cast<double>(static_cast<int64_t>(number))) {
    return BadRequest(Cat("has a '", key, "' that is not a whole number from 0 to ", most));
  }
  return static_cast<int64_t>(number);
}

Result<std::vector<std::string>> WordsOf(const Json& request, const char* key) {
  std::vector<std::string> words;
  const Json* const list = Find(request, key);
  if (list == nullptr) return words;
  if (!list->is_array()) return BadRequest(Cat("has a '", key, "' that is not a list"));
  for (const Json& word : *list) {
    if (!word.is_string()) return BadRequest(Cat("has a value in '", key, "' that is not text"));
    words.push_back(word.get<std::string>());
  }
  return words;
}

}  // namespace anchorsplat::web
