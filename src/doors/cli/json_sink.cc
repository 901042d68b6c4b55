#include "cli/json_sink.h"

#include <chrono>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>

#include "cli/clean_output.h"

namespace anchorsplat {

namespace {

using Clock = std::chrono::steady_clock;

class JsonSink : public LogSink {
 public:
  explicit JsonSink(bool quiet) : quiet_(quiet) {}

  void Message(LogLevel level, const std::string& text) override {
    if (level == LogLevel::kInfo && quiet_) return;
    const char* name = level == LogLevel::kWarning ? "warning" : level == LogLevel::kError ? "error" : "info";
    Line({{"level", name}, {"message", text}});
  }

  void TaskBegin(const std::string& name, int64_t total) override {
    name_ = name;
    total_ = total;
    said_ = {};
    TaskProgress(0, "");
  }

  void TaskProgress(int64_t done, const std::string& note) override {
    const auto now = Clock::now();
    if (now - said_ < std::chrono::milliseconds(100) && done != total_) return;
    said_ = now;
    nlohmann::json line = {{"task", name_}, {"done", done}, {"total", total_}};
    if (!note.empty()) line["note"] = note;
    Line(line);
  }

  void TaskEnd() override {}

 private:
  // One write each, so that lines stay whole.
  static void Line(const nlohmann::json& line) {
    const std::string text = CleanJson(line.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)) + "\n";
    std::fwrite(text.data(), 1, text.size(), stderr);
    std::fflush(stderr);
  }

  bool quiet_;
  std::string name_;
  int64_t total_ = 0;
  Clock::time_point said_;
};

}  // namespace

std::shared_ptr<LogSink> MakeJsonSink(bool quiet) { return std::make_shared<JsonSink>(quiet); }

}  // namespace anchorsplat
