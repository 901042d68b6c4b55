#include "scene/isolated_process.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <cstdlib>
#include <stdexcept>
#include <thread>
#include <vector>

namespace anchorsplat {
namespace {

using ::testing::AnyOf;
using ::testing::HasSubstr;

std::string NoAnswer(std::string_view) { return {}; }

std::string Failure(const std::function<std::string(const AskParent&)>& work, const IsolationLimits& limits = {}) {
  const auto result = RunIsolated(limits, work, NoAnswer);
  EXPECT_FALSE(result.ok());
  return result.ok() ? std::string() : result.error().message;
}

TEST(IsolatedProcess, GivesWhatTheWorkReturns) {
  const std::string large(20'000'000, 'x');  // far more than a socket holds
  EXPECT_EQ(RunIsolated(
                {}, [&](const AskParent&) { return large; }, NoAnswer)
                .value(),
            large);
  EXPECT_EQ(RunIsolated(
                {}, [](const AskParent&) { return ""; }, NoAnswer)
                .value(),
            "");
}

TEST(IsolatedProcess, AsksTheParent) {
  int asked = 0;
  const auto result = RunIsolated(
      {},
      [](const AskParent& ask) {
        std::string all = ask("a");
        all += ask("");
        return all + ask("c");
      },
      [&](std::string_view question) { return "<" + std::string(question) + std::to_string(++asked) + ">"; });
  EXPECT_EQ(result.value(), "<a1><2><c3>");
  EXPECT_EQ(asked, 3);  // in this process
}

TEST(IsolatedProcess, WhateverHappensThereIsAnErrorHere) {
  EXPECT_EQ(Failure([](const AskParent&) -> std::string { throw std::runtime_error("no good"); }), "no good");
  EXPECT_THAT(Failure([](const AskParent&) -> std::string { std::abort(); }), HasSubstr("crashed"));
  EXPECT_THAT(Failure([](const AskParent&) -> std::string {
                std::raise(SIGSEGV);
                return "";
              }),
              HasSubstr("crashed"));
  EXPECT_THAT(Failure([](const AskParent&) -> std::string { std::_Exit(3); }), HasSubstr("3"));
}

TEST(IsolatedProcess, EndlessWorkEnds) {
  IsolationLimits limits;
  limits.max_cpu_seconds = 1;
  // Of processor time; on a machine so busy that it gets less in ten seconds it is ended for its silence.
  EXPECT_THAT(Failure(
                  [](const AskParent&) -> std::string {
                    volatile bool forever = true;
                    while (forever) {
                    }
                    return "";
                  },
                  limits),
              AnyOf(HasSubstr("took more than 1 s"), HasSubstr("stopped responding")));
}

TEST(IsolatedProcess, LongMessagesAreNotTaken) {
  IsolationLimits limits;
  limits.max_message = 10;
  EXPECT_FALSE(RunIsolated(
                   limits, [](const AskParent&) { return std::string(11, 'x'); }, NoAnswer)
                   .ok());
  EXPECT_TRUE(RunIsolated(
                  limits, [](const AskParent&) { return std::string(10, 'x'); }, NoAnswer)
                  .ok());
}

TEST(IsolatedProcess, ManyThreadsAtOnce) {
  std::vector<std::thread> threads;
  std::vector<std::string> results(8);
  for (size_t k = 0; k < results.size(); ++k) {
    threads.emplace_back([&, k] {
      for (int repeat = 0; repeat < 5; ++repeat) {
        results[k] = RunIsolated(
                         {}, [&](const AskParent& ask) { return ask(std::to_string(k)); },
                         [](std::string_view question) { return std::string(question) + "!"; })
                         .value();
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (size_t k = 0; k < results.size(); ++k) EXPECT_EQ(results[k], std::to_string(k) + "!");
}

}  // namespace
}  // namespace anchorsplat
