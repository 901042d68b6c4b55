#include "dataset/process_pool.h"

#include <gtest/gtest.h>

#include <csignal>
#include <fstream>
#include <iterator>
#include <map>

#include "core/run_context.h"
#include "io/folder_for_test.h"

namespace anchorsplat {
namespace {

struct Ends {
  std::map<int64_t, ProcessEnd> ends;
  Status status;
};

Ends RunShell(const std::vector<std::string>& scripts, ProcessPoolOptions options, const TestFolder& folder) {
  Ends run;
  const auto task = [&](int64_t i) {
    return ProcessTask{{"/bin/sh", "-c", scripts[static_cast<size_t>(i)]}, folder / (std::to_string(i) + ".log")};
  };
  const auto ended = [&](int64_t i, const ProcessEnd& end) {
    run.ends[i] = end;
    return true;
  };
  run.status = RunProcesses(std::ssize(scripts), task, ended, options);
  return run;
}

TEST(ProcessPool, TellsEveryKindOfEnd) {
  const TestFolder folder;
  const Ends run = RunShell({"echo fine; echo bad >&2", "exit 7", "kill -SEGV $$"}, {.jobs = 2}, folder);
  ASSERT_TRUE(run.status.ok());
  ASSERT_EQ(run.ends.size(), 3u);
  EXPECT_TRUE(run.ends.at(0).ok());
  EXPECT_EQ(run.ends.at(1).exit_code, 7);
  EXPECT_EQ(run.ends.at(2).signal, SIGSEGV);
  std::ifstream log(folder / "0.log");
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(log), {}), "fine\nbad\n");
}

TEST(ProcessPool, WhatTakesTooLongIsEndedWithItsChildren) {
  const TestFolder folder;
  const Ends run = RunShell({"sleep 1000 & wait", "true"}, {.jobs = 1, .timeout_seconds = 0.2}, folder);
  ASSERT_TRUE(run.status.ok());
  EXPECT_TRUE(run.ends.at(0).timed_out);
  EXPECT_LT(run.ends.at(0).seconds, 60);
  EXPECT_TRUE(run.ends.at(1).ok());
}

TEST(ProcessPool, StopsWhenAsked) {
  const TestFolder folder;
  {
    const std::atomic<bool> stop = true;
    const RunScope run({.stop = &stop});
    EXPECT_TRUE(RunShell({"true", "true"}, {.jobs = 1}, folder).ends.empty());
  }
  int64_t count = 0;
  const auto task = [&](int64_t) { return ProcessTask{{"/bin/true"}, folder / "log"}; };
  ASSERT_TRUE(RunProcesses(5, task, [&](int64_t, const ProcessEnd&) { return ++count < 2; }, {.jobs = 1}).ok());
  EXPECT_EQ(count, 2);
}

TEST(ProcessPool, AProgramThatIsNotThereIsAnError) {
  const TestFolder folder;
  const auto task = [&](int64_t) { return ProcessTask{{"/nowhere/program"}, folder / "log"}; };
  const Status status = RunProcesses(1, task, [](int64_t, const ProcessEnd&) { return true; }, {});
  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.error().message.find("/nowhere/program"), std::string::npos);
}

}  // namespace
}  // namespace anchorsplat
