#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "core/result.h"

namespace anchorsplat {

struct IsolationLimits {
  uint64_t max_memory = uint64_t{8} << 30;   // bytes on top of what the process has already
  int max_cpu_seconds = 120;                 // of processor time; without a word it may take ten times as long
  uint64_t max_message = uint64_t{1} << 32;  // bytes the child may send at once
};

// Asks the parent process; gives its answer. Throws std::runtime_error when the parent is gone.
using AskParent = std::function<std::string(const std::string& request)>;

// Runs `work` in a child process and gives what it returns. Meant for libraries that fall over damaged files: whatever
// happens there – a crash, a failed assertion, endless work, all memory eaten – is an error here and nothing more. The
// child sees memory as it was, but starts with one thread, so `work` must not wait for locks that other threads may
// have held, and reads files by asking: `answer` runs in this process, on the calling thread. The child writes nothing
// to the standard streams and ends with this process.
//
// Errors (kBadFile, a sentence without a beginning): `work` threw (its words), crashed, or went over the limits; kIo:
// the system makes no process.
Result<std::string> RunIsolated(const IsolationLimits& limits, const std::function<std::string(const AskParent&)>& work,
                                const std::function<std::string(std::string_view)>& answer);

}  // namespace anchorsplat
