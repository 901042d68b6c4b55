#include "core/parallel.h"

#include <emscripten/threading.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

#include "core/run.h"

// Parallel loops for the web. A module linked without threads runs chunks in order; with threads, a pool takes chunks
// of any open loop. The thread that started a loop works only on that one, so that PerThread scratch memory is never in
// use twice.
namespace anchorsplat {

namespace {

std::atomic<int> wanted{0};

int ThreadsOfProcess() {
  if (emscripten_has_threading_support() == 0) return 1;
  return wanted > 0 ? wanted.load() : std::max(1, emscripten_num_logical_cores());
}

struct Loop {
  internal::RangeFunction function;
  void* context;
  int64_t begin, end, grain, chunks;
  std::shared_ptr<internal::Run> run;
  std::atomic<int64_t> next{0};
  // Guarded by the pool's mutex.
  int helpers = 0;
  std::exception_ptr failure = nullptr;
};

class Pool {
 public:
  void Run(Loop& loop, int threads) {
    {
      const std::lock_guard lock(mutex_);
      Grow(threads - 1);
      open_.push_back(&loop);
    }
    work_.notify_all();
    Work(loop);
    std::unique_lock lock(mutex_);
    std::erase(open_, &loop);
    done_.wait(lock, [&] { return loop.helpers == 0; });
    if (loop.failure) std::rethrow_exception(loop.failure);
  }

 private:
  void Grow(int helpers) {
    try {
      while (static_cast<int>(threads_.size()) < helpers) threads_.emplace_back([this] { Help(); });
    } catch (const std::system_error&) {  // continue with the threads we have
    }
  }

  // The most recently opened loop that accepts helpers: other loops may be waiting for it.
  Loop* Choose() {
    if (helping_ + 1 >= ThreadsOfProcess()) return nullptr;
    for (size_t k = open_.size(); k-- > 0;) {
      Loop& loop = *open_[k];
      if (loop.next.load(std::memory_order_relaxed) >= loop.chunks) continue;
      if (!loop.run || loop.run->arena.Enter()) return &loop;
    }
    return nullptr;
  }

  void Help() {
    std::unique_lock lock(mutex_);
    for (;;) {
      Loop* loop = nullptr;
      work_.wait(lock, [&] { return (loop = Choose()) != nullptr; });
      ++loop->helpers;
      ++helping_;
      lock.unlock();
      {
        const internal::JoinRun part(loop->run);
        Work(*loop);
      }
      lock.lock();
      --helping_;
      if (loop->run) loop->run->arena.Leave();
      if (--loop->helpers == 0) done_.notify_all();
    }
  }

  void Work(Loop& loop) {
    try {
      for (int64_t chunk = 0; (chunk = loop.next.fetch_add(1)) < loop.chunks;) {
        LeaveIfAbandoned();
        const int64_t first = loop.begin + chunk * loop.grain;
        // Not first + grain, which could overflow at the end of int64_t.
        loop.function(loop.context, first, loop.end - first > loop.grain ? first + loop.grain : loop.end);
      }
    } catch (...) {
      loop.next = loop.chunks;
      const std::lock_guard lock(mutex_);
      if (!loop.failure) loop.failure = std::current_exception();
    }
  }

  std::mutex mutex_;
  std::condition_variable work_, done_;
  std::vector<Loop*> open_;
  std::vector<std::thread> threads_;
  int helping_ = 0;
};

// Never destroyed: its threads end with the module.
Pool& ThePool() {
  static Pool& pool = *new Pool;
  return pool;
}

}  // namespace

void SetThreadCount(int threads) { wanted = std::max(0, threads); }

int ThreadCount() {
  const int of_process = ThreadsOfProcess();
  const auto& run = internal::CurrentRun();
  const int of_run = run ? run->context.threads : 0;
  return of_run > 0 ? std::min(of_run, of_process) : of_process;
}

namespace internal {

void ParallelRanges(int64_t begin, int64_t end, int64_t grain, RangeFunction function, void* context) {
  if (begin >= end) return;
  grain = std::max<int64_t>(1, grain);
  const int64_t chunks = (end - begin - 1) / grain + 1;
  const int threads = chunks == 1 ? 1 : ThreadCount();
  if (threads > 1) {
    Loop loop{function, context, begin, end, grain, chunks, CurrentRun()};
    ThePool().Run(loop, threads);
    return;
  }
  for (int64_t first = begin; first < end;) {
    LeaveIfAbandoned();
    const int64_t last = end - first > grain ? first + grain : end;
    function(context, first, last);
    first = last;
  }
}

}  // namespace internal

}  // namespace anchorsplat
