#include "gpu/with_webgpu/abort_guard.h"

#include <gtest/gtest.h>

#include <csignal>
#include <cstdlib>
#include <thread>

namespace anchorsplat {
namespace {

TEST(AbortGuard, TellsWhetherACallCameBack) {
  int calls = 0;
  EXPECT_TRUE(SurvivesAbort([&] { ++calls; }));
  EXPECT_FALSE(SurvivesAbort([&] {
    ++calls;
    std::abort();
  }));
  EXPECT_TRUE(SurvivesAbort([&] { ++calls; }));
  EXPECT_EQ(calls, 3);
}

TEST(AbortGuard, LeavesTheHandlerThatWasThere) {
  static volatile std::sig_atomic_t raised = 0;
  const auto before = std::signal(SIGABRT, [](int) { raised = raised + 1; });
  EXPECT_FALSE(SurvivesAbort([] { std::abort(); }));
  EXPECT_EQ(raised, 0);
  std::raise(SIGABRT);
  EXPECT_EQ(raised, 1);
  std::signal(SIGABRT, before);
}

TEST(AbortGuardDeathTest, AnotherThreadsAbortEndsTheProgram) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(SurvivesAbort([] { std::thread([] { std::abort(); }).join(); }), ::testing::KilledBySignal(SIGABRT), "");
}

}  // namespace
}  // namespace anchorsplat
