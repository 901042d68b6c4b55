#include "core/parallel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <mutex>
#include <stdexcept>
#include <utility>
#include <vector>

namespace anchorsplat {
namespace {

TEST(ParallelFor, VisitsEveryIndexOnce) {
  for (const int64_t count : {0, 1, 7, 8, 9, 10'000}) {
    for (const int64_t grain : {1, 8, 1000, 100'000}) {
      std::vector<std::atomic<int>> visits(static_cast<size_t>(count));
      ParallelFor(0, count, grain, [&](int64_t first, int64_t last) {
        for (int64_t i = first; i < last; ++i) ++visits[static_cast<size_t>(i)];
      });
      for (const auto& n : visits) ASSERT_EQ(n, 1) << count << " by " << grain;
    }
  }
}

TEST(ParallelFor, RangesDependOnTheGrainOnly) {
  for (const int threads : {1, 2, 5, 0}) {
    SetThreadCount(threads);
    std::mutex mutex;
    std::vector<std::pair<int64_t, int64_t>> ranges;
    ParallelFor(-5, 20, 10, [&](int64_t first, int64_t last) {
      const std::lock_guard lock(mutex);
      ranges.emplace_back(first, last);
    });
    std::sort(ranges.begin(), ranges.end());
    EXPECT_EQ(ranges, (std::vector<std::pair<int64_t, int64_t>>{{-5, 5}, {5, 15}, {15, 20}})) << threads;
  }
}

TEST(ParallelFor, EmptyAndBackwardRangesDoNothing) {
  int calls = 0;
  ParallelFor(3, 3, 1, [&](int64_t, int64_t) { ++calls; });
  ParallelFor(3, -3, 1, [&](int64_t, int64_t) { ++calls; });
  EXPECT_EQ(calls, 0);
}

TEST(ParallelFor, Nests) {
  std::atomic<int64_t> sum{0};
  ParallelFor(0, 30, 3,
              [&](int64_t first, int64_t last) { ParallelFor(first, last, 1, [&](int64_t i, int64_t) { sum += i; }); });
  EXPECT_EQ(sum, 29 * 30 / 2);
}

TEST(ParallelFor, ExceptionsReachTheCaller) {
  EXPECT_THROW(ParallelFor(0, 100, 1,
                           [](int64_t i, int64_t) {
                             if (i == 57) throw std::runtime_error("57");
                           }),
               std::runtime_error);
}

TEST(ThreadCount, IsWhatWasSetAndAtLeastOne) {
  SetThreadCount(1);
  EXPECT_EQ(ThreadCount(), 1);
  SetThreadCount(0);
  EXPECT_GE(ThreadCount(), 1);
}

}  // namespace
}  // namespace anchorsplat
