#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "core/result.h"

namespace anchorsplat {

struct IsolationLimits {
  uint64_t max_memory = uint64_t{8} << 30;   // bytes in addition to the current process's
  int max_cpu_seconds = 120;                 // processor time; wall-clock limit without messages: ten times this
  uint64_t max_message = uint64_t{1} << 32;  // bytes of one message from the child
};

// Sends a request to the parent process and returns its answer. Throws std::runtime_error if the parent is gone.
using AskParent = std::function<std::string(const std::string& request)>;

// Runs `work` in a child process and returns its result. For libraries that crash on damaged files: crashes, failed
// assertions, endless loops and exhausted memory become errors. The child sees a copy of memory but has one thread, so
// `work` must not wait for locks that other threads may have held. It reads files by asking: `answer` runs in this
// process on the calling thread. The child writes nothing to the standard streams and ends with this process.
//
// Errors: kBadFile (a sentence without its beginning): `work` threw (its words), crashed, or exceeded a limit; kIo: no
// process could be created.
Result<std::string> RunIsolated(const IsolationLimits& limits, const std::function<std::string(const AskParent&)>& work,
                                const std::function<std::string(std::string_view)>& answer);

}  // namespace anchorsplat
