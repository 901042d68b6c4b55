#include "core/run_context.h"

#include <gtest/gtest.h>

#include <barrier>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "core/parallel.h"
#include "core/text.h"

namespace anchorsplat {
namespace {

class CountingSink : public LogSink {
 public:
  void Message(LogLevel, const std::string& text) override { ++messages[text]; }
  void TaskBegin(const std::string& name, int64_t) override { tasks.push_back(name); }
  void TaskProgress(int64_t done, const std::string&) override { last = done; }
  void TaskEnd() override { ++ended; }

  std::map<std::string, int> messages;
  std::vector<std::string> tasks;
  int64_t last = 0;
  int ended = 0;
};

TEST(RunContext, TwoRunsSideBySideDoNotSeeEachOther) {
  constexpr int64_t kLoop = 2000;
  std::barrier both(2);
  std::shared_ptr<CountingSink> sinks[2] = {std::make_shared<CountingSink>(), std::make_shared<CountingSink>()};
  std::atomic<bool> stops[2] = {false, false};
  std::vector<int64_t> sums[2];
  int limits[2] = {0, 0}, asked[2] = {0, 0};
  const auto work = [&](int i) {
    const RunScope run({.threads = i + 1, .sink = sinks[i], .stop = &stops[i]});
    limits[i] = ThreadCount();
    both.arrive_and_wait();
    const Progress progress_of_run(Cat("task ", i), kLoop);
    Progress progress(Cat("inner ", i), kLoop);
    sums[i].assign(kLoop, 0);
    std::atomic<int> stopped{0};
    ParallelFor(0, kLoop, 1, [&](int64_t first, int64_t) {
      // Loops within a loop, on whatever thread it runs.
      std::atomic<int64_t> sum{0};
      ParallelFor(0, 8, 1, [&](int64_t k, int64_t) {
        sum += k;
        if (k == 3) LogInfo(Cat("run ", i));
      });
      sums[i][static_cast<size_t>(first)] = sum + first;
      stopped += StopRequested() ? 1 : 0;
      progress.Advance();
      if (i == 0 && first == kLoop / 2) stops[1] = true;
    });
    both.arrive_and_wait();
    asked[i] = StopRequested() ? 1 : 0;
    EXPECT_EQ(i == 0 ? stopped.load() : 0, 0);
  };
  std::thread other([&] { work(1); });
  work(0);
  other.join();

  EXPECT_EQ(limits[0], 1);
  EXPECT_LE(limits[1], 2);
  EXPECT_EQ(asked[0], 0);
  EXPECT_EQ(asked[1], 1);
  EXPECT_EQ(sums[0], sums[1]) << "results do not depend on the run";
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(sinks[i]->messages, (std::map<std::string, int>{{Cat("run ", i), kLoop}}));
    EXPECT_EQ(sinks[i]->tasks, (std::vector<std::string>{Cat("task ", i), Cat("inner ", i)}));
    EXPECT_EQ(sinks[i]->last, kLoop);
    EXPECT_EQ(sinks[i]->ended, 2);
  }
  EXPECT_FALSE(StopRequested()) << "this thread is in no run any more";
}

TEST(RunContext, ALimitIsKept) {
  std::mutex mutex;
  std::set<std::thread::id> threads;
  const RunScope run({.threads = 1});
  ParallelFor(0, 500, 1, [&](int64_t, int64_t) {
    const std::lock_guard lock(mutex);
    threads.insert(std::this_thread::get_id());
  });
  EXPECT_EQ(threads.size(), 1u);
  EXPECT_EQ(ThreadCount(), 1);
}

TEST(RunContext, AnAbandonedOneLeavesItsLoopsAndNobodyElses) {
  std::atomic<bool> abandon{false};
  std::atomic<int64_t> done{0};
  constexpr int64_t kLoop = 100'000;
  const auto work = [&] {
    const RunScope run({.threads = 2, .abandon = &abandon});
    ParallelFor(0, kLoop, 1, [&](int64_t first, int64_t) {
      if (first == 1000) abandon = true;
      ++done;
    });
  };
  EXPECT_THROW(work(), RunAbandoned);
  EXPECT_LT(done, kLoop);
  {
    const RunScope outer({.abandon = &abandon});
    const RunScope inner({});
    EXPECT_THROW(LeaveIfAbandoned(), RunAbandoned) << "of the run around";
    EXPECT_THROW(ParallelFor(0, 10, 1, [](int64_t, int64_t) {}), RunAbandoned);
  }
  LeaveIfAbandoned();
  ParallelFor(0, 10, 1, [&](int64_t, int64_t) {});
}

TEST(RunContext, WhatIsLeftOutIsThatOfTheRunAround) {
  const auto outer = std::make_shared<CountingSink>(), inner = std::make_shared<CountingSink>();
  std::atomic<bool> stop{true};
  {
    const RunScope a({.threads = 1, .sink = outer, .stop = &stop});
    {
      const RunScope b({.sink = inner});
      EXPECT_TRUE(StopRequested());
      EXPECT_EQ(ThreadCount(), 1);
      LogInfo("b");
      *internal::CurrentStorage().Get<int>() = 7;
    }
    LogInfo("a");
    EXPECT_EQ(*internal::CurrentStorage().Get<int>(), 7) << "one record of files, for instance, for all of a run";
  }
  EXPECT_EQ(outer->messages, (std::map<std::string, int>{{"a", 1}}));
  EXPECT_EQ(inner->messages, (std::map<std::string, int>{{"b", 1}}));
  EXPECT_EQ(*internal::CurrentStorage().Get<int>(), 0);
}

}  // namespace
}  // namespace anchorsplat
