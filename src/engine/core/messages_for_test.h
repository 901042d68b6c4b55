#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/log.h"

namespace anchorsplat {

// Captures log messages while it lives.
class Messages {
 public:
  Messages() : before_(SetLogSink(sink_)) {}
  ~Messages() { SetLogSink(before_); }
  Messages(const Messages&) = delete;
  Messages& operator=(const Messages&) = delete;

  const std::vector<std::string>& warnings() const { return sink_->warnings; }
  const std::vector<std::string>& notes() const { return sink_->notes; }
  std::vector<std::string> TakeWarnings() { return std::exchange(sink_->warnings, {}); }

 private:
  struct Sink : LogSink {
    void Message(LogLevel level, const std::string& text) override {
      (level == LogLevel::kWarning ? warnings : notes).push_back(text);
    }
    void TaskBegin(const std::string&, int64_t) override {}
    void TaskProgress(int64_t, const std::string&) override {}
    void TaskEnd() override {}
    std::vector<std::string> warnings, notes;
  };
  std::shared_ptr<Sink> sink_ = std::make_shared<Sink>();
  std::shared_ptr<LogSink> before_;
};

}  // namespace anchorsplat
