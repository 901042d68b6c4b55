#pragma once

#include <cstdint>
#include <memory>
#include <string>

namespace anchorsplat {

namespace internal {
struct Run;
}

// Everything the program says while it works is an *event*; a sink decides what becomes of it. Bars, --quiet, --json
// and tests all read the same events. No other code writes to stderr. Strings only, so that no formatting library
// reaches our headers (LibTorch carries its own fmt).
enum class LogLevel { kInfo, kWarning, kError };

class LogSink {
 public:
  virtual ~LogSink() = default;
  virtual void Message(LogLevel level, const std::string& text) = 0;
  // A task of `total` steps begins (0 = unknown), advances to `done` with a short note, ends. One at a time in a run.
  virtual void TaskBegin(const std::string& name, int64_t total) = 0;
  virtual void TaskProgress(int64_t done, const std::string& note) = 0;
  virtual void TaskEnd() = 0;
};

// Replaces the sink of the process and returns the one before; a run may have its own (core/run_context.h). The first
// one prints messages to stderr, bars only when stderr is a terminal. Events may come from any thread: they are
// serialised before they reach the sink.
std::shared_ptr<LogSink> SetLogSink(std::shared_ptr<LogSink> sink);
std::shared_ptr<LogSink> MakeTerminalSink(bool quiet);  // quiet: warnings and errors only, no bars

void LogInfo(const std::string& text);
void LogWarning(const std::string& text);
void LogError(const std::string& text);

// A task for as long as the object lives. Advance() may be called from any thread and at any rate.
class Progress {
 public:
  Progress(const std::string& name, int64_t total);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  void Advance(int64_t steps = 1, const std::string& note = {});

 private:
  std::shared_ptr<internal::Run> run_;  // that it belongs to, whoever advances it
  int64_t done_ = 0;
};

}  // namespace anchorsplat
