#include "cli/stop_signal.h"

#include <signal.h>

#include <csignal>

namespace anchorsplat {

namespace {

std::atomic<bool> stop_requested{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler may not lock");

void RequestStop(int signal) {
  stop_requested = true;
  std::signal(signal, signal == SIGHUP ? SIG_IGN : SIG_DFL);
}

void SetUnlessIgnored(int signal, void (*handler)(int)) {
  struct sigaction now {};
  const bool ignored = sigaction(signal, nullptr, &now) == 0 && now.sa_handler == SIG_IGN;
  if (!ignored) std::signal(signal, handler);
}

}  // namespace

StopSignal::StopSignal(Leaves leaves)
    : run_({.stop = &stop_requested, .abandon = leaves == Leaves::kNothing ? &stop_requested : nullptr}) {
  std::signal(SIGINT, RequestStop);
  std::signal(SIGTERM, RequestStop);
  SetUnlessIgnored(SIGHUP, RequestStop);
  std::signal(SIGPIPE, SIG_IGN);
}

StopSignal::~StopSignal() {
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
  // After a stop request results are still written, even if the terminal is gone.
  if (stop_requested) return;
  SetUnlessIgnored(SIGHUP, SIG_DFL);
  std::signal(SIGPIPE, SIG_DFL);
}

}  // namespace anchorsplat
