#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "core/result.h"

namespace anchorsplat {

// Calls `take` with the JSON object and number (from 1) of every non-empty line. The file may be gzipped; at most 256
// MiB.
// Errors: kNotFound, kIo; kBadFile naming the line: no JSON object, an error text from `take`, or an exception of the
// JSON library for a missing property or wrong type.
Status ForEachJsonLine(const std::filesystem::path& path,
                       const std::function<std::string(const nlohmann::json&, int64_t line)>& take);

}  // namespace anchorsplat
