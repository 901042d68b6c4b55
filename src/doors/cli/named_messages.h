#pragma once

#include <memory>
#include <string>
#include <utility>

#include "core/log.h"
#include "core/text.h"

namespace anchorsplat {

// During its lifetime, messages begin with the name of the file that they are about.
class NamedMessages {
 public:
  explicit NamedMessages(std::string name) : sink_(std::make_shared<Sink>(std::move(name))) {
    sink_->to = SetLogSink(sink_);
  }
  ~NamedMessages() { SetLogSink(sink_->to); }
  NamedMessages(const NamedMessages&) = delete;
  NamedMessages& operator=(const NamedMessages&) = delete;

 private:
  struct Sink final : LogSink {
    explicit Sink(std::string of) : name(std::move(of)) {}
    void Message(LogLevel level, const std::string& text) override {
      to->Message(level, text.starts_with(name) ? text : Cat(name, ": ", text));
    }
    void TaskBegin(const std::string& task, int64_t total) override { to->TaskBegin(task, total); }
    void TaskProgress(int64_t done, const std::string& note) override { to->TaskProgress(done, note); }
    void TaskEnd() override { to->TaskEnd(); }

    std::string name;
    std::shared_ptr<LogSink> to;
  };
  std::shared_ptr<Sink> sink_;
};

}  // namespace anchorsplat
