#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/result.h"

namespace anchorsplat::web {

// Reads members of a request of Engine::Call. Null members count as missing.
using Json = nlohmann::json;

// kBadArgument: "the request " and `what`.
Error BadRequest(const std::string& what);

const Json* Find(const Json& request, const char* key);
// Empty if it is not text.
std::string TextOf(const Json& request, const char* key);
// A whole number from 0 to `most`; 0 if missing. Errors: BadRequest.
Result<int64_t> NumberOf(const Json& request, const char* key, int64_t most);
// A list of texts, empty if missing. Errors: BadRequest.
Result<std::vector<std::string>> WordsOf(const Json& request, const char* key = "words");

}  // namespace anchorsplat::web
