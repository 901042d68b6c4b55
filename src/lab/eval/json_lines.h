#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "core/result.h"

namespace anchorsplat {

// Calls `take` with the object of every line that is not empty, and the line's number, from 1. The file may be gzipped,
// and has 256 MiB at most. Errors: kNotFound, kIo; kBadFile, naming the line: it is no JSON object, `take` says what is
// wrong with it, or looks (by an exception of the library) for a property or a type that it has not.
Status ForEachJsonLine(const std::filesystem::path& path,
                       const std::function<std::string(const nlohmann::json&, int64_t line)>& take);

}  // namespace anchorsplat
