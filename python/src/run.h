#pragma once

#include <nanobind/nanobind.h>

#include <cstdint>
#include <exception>
#include <functional>
#include <optional>
#include <type_traits>
#include <utility>

#include "core/device_choice.h"
#include "core/result.h"

namespace anchorsplat::python {

namespace nb = nanobind;

// How a call is run, as the Python side says it (anchorsplat/_run.py).
struct RunArguments {
  int threads = 0;  // at most; 0: all of the machine
  // Called in the calling thread with a list of what was said and how far it has come since the last time; may be None.
  nb::object tell;
  // The call can end in order with something kept (a checkpoint): the first Ctrl-C asks for that, the second one ends
  // it. Otherwise the first one does.
  bool patient = false;
  DeviceChoice device;
  uint64_t max_gpu_memory = 0;  // bytes; 0: the default
};

// An Error on its way to Python, where it is one of anchorsplat._errors.
struct EngineError : std::exception {
  explicit EngineError(Error of) : error(std::move(of)) {}
  const char* what() const noexcept override { return error.message.c_str(); }
  Error error;
};

// Runs `work` in a thread of its own and in a run of its own, without the interpreter's lock, and waits. Meanwhile
// messages and progress are handed to `tell`, and signals are looked for 20 times a second: when a handler raises
// (KeyboardInterrupt), or `tell` does, the work is abandoned, and when it has ended the exception goes on. Nothing that
// `work` reads is overwritten by it. Throws EngineError and nanobind's python_error.
void RunEngine(const RunArguments& run, const std::function<Status()>& work);

// The same of work with a result.
template <typename Work>
auto ResultOf(const RunArguments& run, Work&& work) {
  std::optional<std::decay_t<decltype(*work())>> value;
  RunEngine(run, [&]() -> Status {
    auto result = work();
    if (!result.ok()) return result.error();
    value.emplace(*std::move(result));
    return {};
  });
  return *std::move(value);
}

// The value of what is quick, or EngineError.
template <typename T>
T OrThrow(Result<T> result) {
  if (!result.ok()) throw EngineError(result.error());
  return *std::move(result);
}
inline void OrThrow(const Status& status) {
  if (!status.ok()) throw EngineError(status.error());
}

void BindRun(nb::module_& module);

}  // namespace anchorsplat::python
