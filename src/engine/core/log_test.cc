#include "core/log.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include "core/parallel.h"
#include "core/text.h"

namespace anchorsplat {
namespace {

class RecordingSink : public LogSink {
 public:
  void Message(LogLevel level, const std::string& text) override {
    events.push_back(Cat("message ", static_cast<int>(level), " ", text));
  }
  void TaskBegin(const std::string& name, int64_t total) override { events.push_back(Cat("begin ", name, " ", total)); }
  void TaskProgress(int64_t done, const std::string& note) override {
    events.push_back(Cat("progress ", done, " ", note));
  }
  void TaskEnd() override { events.push_back("end"); }

  std::vector<std::string> events;
};

class Log : public ::testing::Test {
 protected:
  std::shared_ptr<RecordingSink> sink = std::make_shared<RecordingSink>();
  std::shared_ptr<LogSink> before = SetLogSink(sink);
  ~Log() override { SetLogSink(before); }
};

TEST_F(Log, EventsReachTheSinkInOrder) {
  LogInfo("one");
  {
    Progress progress("task", 3);
    progress.Advance();
    progress.Advance(2, "note");
    LogWarning("two");
  }
  LogError("three");
  EXPECT_EQ(sink->events, (std::vector<std::string>{"message 0 one", "begin task 3", "progress 1 ", "progress 3 note",
                                                    "message 1 two", "end", "message 2 three"}));
}

TEST_F(Log, ThreadsMayReportAtTheSameTime) {
  {
    Progress progress("task", 1000);
    ParallelFor(0, 1000, 1, [&](int64_t, int64_t) { progress.Advance(); });
  }
  ASSERT_EQ(sink->events.size(), 1002u);
  for (size_t k = 1; k <= 1000; ++k) ASSERT_EQ(sink->events[k], Cat("progress ", k, " "));  // none lost, none twice
}

TEST_F(Log, SettingReturnsTheSinkBefore) {
  const auto other = std::make_shared<RecordingSink>();
  EXPECT_EQ(SetLogSink(other), sink);
  LogInfo("to the other");
  EXPECT_EQ(SetLogSink(sink), other);
  EXPECT_EQ(other->events.size(), 1u);
  EXPECT_TRUE(sink->events.empty());
}

// Stands in for a person's terminal as standard error.
class Terminal {
 public:
  Terminal() : master_(posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK)), stderr_(dup(STDERR_FILENO)) {
    if (master_ < 0 || grantpt(master_) != 0 || unlockpt(master_) != 0) return;
    const int slave = open(ptsname(master_), O_RDWR | O_NOCTTY);
    ok_ = slave >= 0 && dup2(slave, STDERR_FILENO) >= 0;
    close(slave);
  }
  ~Terminal() {
    dup2(stderr_, STDERR_FILENO);
    close(stderr_);
    close(master_);
  }
  bool ok() const { return ok_; }
  // All that was written so far; what is written to a terminal is there to be read at once.
  std::string Shown() const {
    std::string shown;
    char text[4096];
    for (ssize_t n = 0; (n = read(master_, text, sizeof text)) > 0;) shown.append(text, static_cast<size_t>(n));
    return shown;
  }

 private:
  int master_;
  int stderr_;
  bool ok_ = false;
};

TEST(TerminalSink, DrawsABarWhateverTheNumbers) {
  for (const auto& [done, total, expected] :
       std::vector<std::tuple<int64_t, int64_t, const char*>>{{5, 10, "[############............] 5/10"},
                                                              {10, 10, "[########################] 10/10"},
                                                              {25, 10, "[########################] 25/10"},
                                                              {-3, 10, "[........................] -3/10"},
                                                              {7, 0, "work 7"}}) {
    const Terminal terminal;
    ASSERT_TRUE(terminal.ok());
    const auto sink = MakeTerminalSink(false);
    sink->TaskBegin("work", total);
    sink->TaskProgress(done, "note");
    const std::string shown = terminal.Shown();
    EXPECT_NE(shown.find(expected), std::string::npos) << shown;
    EXPECT_NE(shown.find("note"), std::string::npos) << shown;
  }
}

TEST(TerminalSink, ShowsBytesThatCouldCommandATerminal) {
  const Terminal terminal;
  ASSERT_TRUE(terminal.ok());
  MakeTerminalSink(false)->Message(LogLevel::kError, "a\x1b[2J\xff\nb ä");
  EXPECT_NE(terminal.Shown().find("error: a\\x1b[2J\\xff\\x0ab ä"), std::string::npos);
}

TEST(TerminalSink, QuietKeepsWarningsAndErrors) {
  const Terminal terminal;
  ASSERT_TRUE(terminal.ok());
  const auto sink = MakeTerminalSink(true);
  sink->Message(LogLevel::kInfo, "unheard");
  sink->TaskBegin("work", 10);
  sink->TaskProgress(5, "unseen");
  sink->TaskEnd();
  sink->Message(LogLevel::kWarning, "careful");
  sink->Message(LogLevel::kError, "broken");
  const std::string shown = terminal.Shown();
  EXPECT_EQ(shown.find("un"), std::string::npos) << shown;
  EXPECT_NE(shown.find("warning: careful"), std::string::npos) << shown;
  EXPECT_NE(shown.find("error: broken"), std::string::npos) << shown;
}

}  // namespace
}  // namespace anchorsplat
