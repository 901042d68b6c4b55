#pragma once

#include <cstdint>
#include <memory>
#include <string>

namespace anchorsplat {

namespace internal {
struct Run;
}

// Messages and progress are *events*; a sink decides how to show them. Bars, --quiet, --json and tests read the same
// events, and no other code writes to stderr. Events are plain strings, so that no formatting library reaches our
// headers (LibTorch brings its own fmt).
enum class LogLevel { kInfo, kWarning, kError };

class LogSink {
 public:
  virtual ~LogSink() = default;
  virtual void Message(LogLevel level, const std::string& text) = 0;
  // Start, progress and end of a task. `total` = number of steps, 0 if unknown; `note` is a short text. One task at a
  // time per run.
  virtual void TaskBegin(const std::string& name, int64_t total) = 0;
  virtual void TaskProgress(int64_t done, const std::string& note) = 0;
  virtual void TaskEnd() = 0;
};

// Sets the sink of the process and returns the previous one; a run can have its own (core/run_context.h). The default
// sink prints messages to stderr, and bars only if stderr is a terminal. Events may come from any thread; the sink gets
// them one at a time.
std::shared_ptr<LogSink> SetLogSink(std::shared_ptr<LogSink> sink);
std::shared_ptr<LogSink> MakeTerminalSink(bool quiet);  // quiet: warnings and errors only, no bars

void LogInfo(const std::string& text);
void LogWarning(const std::string& text);
void LogError(const std::string& text);

// A task that lasts as long as this object. Advance() is thread-safe and cheap enough to call often.
class Progress {
 public:
  Progress(const std::string& name, int64_t total);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  void Advance(int64_t steps = 1, const std::string& note = {});

 private:
  std::shared_ptr<internal::Run> run_;  // the run that owns the task, whichever thread advances it
  int64_t done_ = 0;
};

}  // namespace anchorsplat
