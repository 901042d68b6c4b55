#include "gpu/with_webgpu/abort_guard.h"

#include <csetjmp>
#include <csignal>
#include <mutex>

namespace anchorsplat {

namespace {

thread_local sigjmp_buf* abort_return = nullptr;

struct sigaction handler_before = {};

void LeaveLibrary(int signal) {
  if (abort_return != nullptr) siglongjmp(*abort_return, 1);
  // An unguarded thread: abort() proceeds as usual when this returns.
  sigaction(signal, &handler_before, nullptr);
  std::raise(signal);
}

// The handler is installed while any thread is guarded.
class AbortHandler {
 public:
  void Add() {
    const std::lock_guard lock(mutex_);
    if (guarded_++ > 0) return;
    struct sigaction ours = {};
    ours.sa_handler = LeaveLibrary;
    sigemptyset(&ours.sa_mask);
    sigaction(SIGABRT, &ours, &handler_before);
  }
  void Remove() {
    const std::lock_guard lock(mutex_);
    if (--guarded_ == 0) sigaction(SIGABRT, &handler_before, nullptr);
  }

 private:
  std::mutex mutex_;
  int guarded_ = 0;
};

}  // namespace

bool SurvivesAbort(const std::function<void()>& library_call) {
  static AbortHandler& handler = *new AbortHandler;
  sigjmp_buf here;
  handler.Add();
  volatile bool survived = false;
  if (sigsetjmp(here, 1) == 0) {
    abort_return = &here;
    library_call();
    survived = true;
  }
  abort_return = nullptr;
  handler.Remove();
  return survived;
}

}  // namespace anchorsplat
