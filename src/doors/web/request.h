#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/result.h"

namespace anchorsplat::web {

// What is in a request of Engine::Call. Members that are null count as missing.
using Json = nlohmann::json;

// kBadArgument: "the request " and `what`.
Error BadRequest(const std::string& what);

const Json* Find(const Json& request, const char* key);
// Empty where there is no text.
std::string TextOf(const Json& request, const char* key);
// A whole number from 0 to `most`; 0 where there is none. Errors: BadRequest.
Result<int64_t> NumberOf(const Json& request, const char* key, int64_t most);
// A list of texts, empty where there is none. Errors: BadRequest.
Result<std::vector<std::string>> WordsOf(const Json& request, const char* key = "words");

}  // namespace anchorsplat::web
