#pragma once

#include <memory>

#include "core/log.h"

namespace anchorsplat {

// For --progress json, used by calling programs: every event is a line of JSON on stderr, one of
//
//   {"level": "info" | "warning" | "error", "message": TEXT}
//   {"task": NAME, "done": N, "total": N, "note": TEXT}   (total 0: unknown; no note where there is none; at most ten a
//                                                          second, and the last one)
//
// quiet: warnings, errors and progress only.
std::shared_ptr<LogSink> MakeJsonSink(bool quiet);

}  // namespace anchorsplat
