#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <array>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <source_location>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "cli/verb.h"
#include "core/log.h"
#include "core/parallel.h"
#include "io/file_bytes_for_test.h"

namespace anchorsplat {

// For tests: the program as a function. What only a process shows (signals, pipes, what a shell sees of an exit code)
// is in behaviour/.

// What RunProgram changes for the whole process: put back at the end.
class ProcessState {
 public:
  ProcessState() : sink_(SetLogSink(MakeTerminalSink(false))), console_(std::cout.rdbuf()) {
    for (size_t k = 0; k < kSignals.size(); ++k) sigaction(kSignals[k], nullptr, &actions_[k]);
  }
  ~ProcessState() {
    for (size_t k = 0; k < kSignals.size(); ++k) sigaction(kSignals[k], &actions_[k], nullptr);
    std::cout.rdbuf(console_);  // and forgets that something could not be written
    SetThreadCount(0);
    SetLogSink(std::move(sink_));
  }
  ProcessState(const ProcessState&) = delete;
  ProcessState& operator=(const ProcessState&) = delete;

 private:
  static constexpr std::array kSignals = {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGXFSZ};
  std::shared_ptr<LogSink> sink_;
  std::streambuf* console_;
  std::array<struct sigaction, kSignals.size()> actions_{};
};

struct ProgramRun {
  std::string command;
  int code = 0;     // what the shell would get
  std::string out;  // stdout
  std::string err;  // stderr

  // Of a run with --json; `discarded` where stdout is anything but one document.
  nlohmann::json json() const { return nlohmann::json::parse(out, nullptr, /*allow_exceptions=*/false); }
};

// Runs `anchorsplat WORDS`.
inline ProgramRun RunWords(const std::vector<std::string>& words, Trainer trainer = {}) {
  ProgramRun run;
  run.command = "anchorsplat";
  std::vector<const char*> arguments = {"anchorsplat"};
  for (const std::string& word : words) {
    run.command += " " + word;
    arguments.push_back(word.c_str());
  }
  std::ostringstream out;
  const ProcessState state;
  std::cout.rdbuf(out.rdbuf());
  testing::internal::CaptureStderr();
  run.code = RunProgram(static_cast<int>(arguments.size()), arguments.data(), trainer);
  run.err = testing::internal::GetCapturedStderr();
  run.out = out.str();
  return run;
}

// Expects the run to succeed.
inline ProgramRun ExpectDone(const std::vector<std::string>& words,
                             const std::source_location& at = std::source_location::current()) {
  ProgramRun run = RunWords(words);
  const testing::ScopedTrace where(at.file_name(), static_cast<int>(at.line()), run.command);
  EXPECT_EQ(run.code, 0) << run.err;
  return run;
}

// Expects success, and one JSON document on stdout and nothing else.
inline nlohmann::json ExpectJson(std::vector<std::string> words,
                                 const std::source_location& at = std::source_location::current()) {
  words.emplace_back("--json");
  const ProgramRun run = ExpectDone(words, at);
  const testing::ScopedTrace where(at.file_name(), static_cast<int>(at.line()), run.command);
  EXPECT_FALSE(run.json().is_discarded()) << run.out;
  return run.json();
}

// Expects the run to end with the code of this error, and stderr to hold each of `says`.
inline ProgramRun ExpectRefused(const std::vector<std::string>& words, ErrorCode code,
                                const std::vector<std::string>& says = {},
                                const std::source_location& at = std::source_location::current()) {
  ProgramRun run = RunWords(words);
  const testing::ScopedTrace where(at.file_name(), static_cast<int>(at.line()), run.command);
  EXPECT_EQ(run.code, ExitCode(code)) << run.err;
  for (const std::string& text : says) EXPECT_THAT(run.err, testing::HasSubstr(text));
  return run;
}

inline void WriteText(const std::filesystem::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

}  // namespace anchorsplat
