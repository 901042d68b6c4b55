#include "core/log.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <limits>
#include <mutex>
#include <utility>

#include "core/run.h"
#include "core/text.h"

namespace anchorsplat {

namespace {

using Clock = std::chrono::steady_clock;

class TerminalSink : public LogSink {
 public:
  explicit TerminalSink(bool quiet) : quiet_(quiet), bars_(!quiet && isatty(STDERR_FILENO) == 1) {}

  void Message(LogLevel level, const std::string& text) override {
    if (level == LogLevel::kInfo && quiet_) return;
    Erase();
    const char* prefix = level == LogLevel::kWarning ? "warning: " : level == LogLevel::kError ? "error: " : "";
    // Messages name files and quote what is in them: bytes that could command the terminal or break its line are shown.
    std::fprintf(stderr, "%s%s\n", prefix, Printable(text, std::numeric_limits<size_t>::max()).c_str());
  }

  void TaskBegin(const std::string& name, int64_t total) override {
    name_ = name;
    total_ = total;
    begin_ = Clock::now();
    drawn_ = {};
  }

  void TaskProgress(int64_t done, const std::string& note) override {
    const auto now = Clock::now();
    // Ten redraws a second are enough for a person and cost nothing.
    if (!bars_ || (now - drawn_ < std::chrono::milliseconds(100) && done != total_)) return;
    drawn_ = now;
    const double seconds = std::chrono::duration<double>(now - begin_).count();
    std::string line = name_;
    if (total_ > 0) {
      constexpr int64_t kWidth = 24;
      // More steps than announced are a small mistake of the caller, not a reason to fall over.
      const int64_t filled = kWidth * std::clamp<int64_t>(done, 0, total_) / total_;
      line += " [" + std::string(static_cast<size_t>(filled), '#') +
              std::string(static_cast<size_t>(kWidth - filled), '.') + "] " + Cat(done, "/", total_);
      if (done > 0 && done < total_ && seconds > 1) {
        line += "  " + HumanSeconds(seconds * static_cast<double>(total_ - done) / static_cast<double>(done)) + " left";
      }
    } else {
      line += " " + WithThousands(done) + "  " + HumanSeconds(seconds);
    }
    if (!note.empty()) line += "  " + note;
    std::fprintf(stderr, "\r\x1b[2K%s", Printable(line, std::numeric_limits<size_t>::max()).c_str());
    std::fflush(stderr);
    visible_ = true;
  }

  void TaskEnd() override { Erase(); }

 private:
  void Erase() {
    if (visible_) std::fputs("\r\x1b[2K", stderr);
    visible_ = false;
  }

  bool quiet_;
  bool bars_;
  bool visible_ = false;
  std::string name_;
  int64_t total_ = 0;
  Clock::time_point begin_;
  Clock::time_point drawn_;
};

std::mutex& ProcessMutex() {
  static std::mutex mutex;
  return mutex;
}

std::shared_ptr<LogSink>& ProcessSink() {
  static std::shared_ptr<LogSink> sink = MakeTerminalSink(false);
  return sink;
}

// Calls say(sink) for the sink of the run, or the process's where the run has none; one event at a time.
template <typename Say>
void Tell(const std::shared_ptr<internal::Run>& run, Say&& say) {
  if (run && run->context.sink) {
    const std::lock_guard lock(run->log_mutex);
    say(*run->context.sink);
  } else {
    const std::lock_guard lock(ProcessMutex());
    say(*ProcessSink());
  }
}

void Log(LogLevel level, const std::string& text) {
  Tell(internal::CurrentRun(), [&](LogSink& sink) { sink.Message(level, text); });
}

}  // namespace

std::shared_ptr<LogSink> MakeTerminalSink(bool quiet) { return std::make_shared<TerminalSink>(quiet); }

std::shared_ptr<LogSink> SetLogSink(std::shared_ptr<LogSink> sink) {
  const std::lock_guard lock(ProcessMutex());
  return std::exchange(ProcessSink(), std::move(sink));
}

void LogInfo(const std::string& text) { Log(LogLevel::kInfo, text); }
void LogWarning(const std::string& text) { Log(LogLevel::kWarning, text); }
void LogError(const std::string& text) { Log(LogLevel::kError, text); }

Progress::Progress(const std::string& name, int64_t total) : run_(internal::CurrentRun()) {
  Tell(run_, [&](LogSink& sink) { sink.TaskBegin(name, total); });
}

Progress::~Progress() {
  Tell(run_, [](LogSink& sink) { sink.TaskEnd(); });
}

void Progress::Advance(int64_t steps, const std::string& note) {
  Tell(run_, [&](LogSink& sink) {
    done_ += steps;
    sink.TaskProgress(done_, note);
  });
}

}  // namespace anchorsplat
