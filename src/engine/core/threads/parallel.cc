#include "core/parallel.h"

#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>

#include <algorithm>

#include "core/parallel_section.h"
#include "core/run.h"

namespace anchorsplat {

namespace {
// Kept alive for the whole process: oneTBB honours a limit only while its object lives.
std::unique_ptr<tbb::global_control>& Limit() {
  static std::unique_ptr<tbb::global_control> limit;
  return limit;
}
}  // namespace

void SetThreadCount(int threads) {
  Limit().reset();
  if (threads > 0) {
    Limit() = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                    static_cast<size_t>(threads));
  }
}

int ThreadCount() {
  const size_t of_process =
      std::min<size_t>(static_cast<size_t>(tbb::info::default_concurrency()),
                       tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
  const auto& run = internal::CurrentRun();
  const int of_run = run ? run->context.threads : 0;
  return of_run > 0 ? std::min(of_run, static_cast<int>(of_process)) : static_cast<int>(of_process);
}

void ParallelSection(const std::function<void()>& section) {
  if (const std::shared_ptr<internal::Run> run = internal::CurrentRun()) {
    run->arena.execute(section);
  } else {
    section();
  }
}

namespace internal {

void ParallelRanges(int64_t begin, int64_t end, int64_t grain, RangeFunction function, void* context) {
  if (begin >= end) return;
  grain = std::max<int64_t>(1, grain);
  const int64_t chunks = (end - begin + grain - 1) / grain;
  LeaveIfAbandoned();
  if (chunks == 1) {
    function(context, begin, end);
    return;
  }
  const auto one = [&](int64_t chunk) {
    const int64_t first = begin + chunk * grain;
    function(context, first, std::min(end, first + grain));
  };
  if (const std::shared_ptr<Run> run = CurrentRun()) {
    run->arena.execute([&] {
      tbb::parallel_for(
          int64_t{0}, chunks,
          [&](int64_t chunk) {
            const JoinRun part(run);
            LeaveIfAbandoned();
            one(chunk);
          },
          tbb::simple_partitioner());
    });
    return;
  }
  tbb::parallel_for(int64_t{0}, chunks, one, tbb::simple_partitioner());
}

}  // namespace internal

}  // namespace anchorsplat
