// fuzz_readers: feeds damaged files to every reader. A child process reads them one by one; the parent detects a crash
// or hang, saves the input, and prints how to reproduce it.

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <thread>

#include "core/text.h"
#include "formats/fuzz/mutation.h"
#include "formats/fuzz/readers.h"

#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#define __SANITIZE_ADDRESS__ 1  // clang spells it differently
#endif
#endif
#if defined(__SANITIZE_ADDRESS__)
// Inputs have at most a megabyte: a reader that allocates this much at once trusted a header.
extern "C" const char* __asan_default_options() {  // NOLINT: the sanitizer's name
  return "max_allocation_size_mb=256:hard_rss_limit_mb=3072:detect_stack_use_after_return=0";
}
#endif

namespace anchorsplat {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

struct Options {
  double seconds = 0;
  uint64_t inputs = 20'000;
  uint64_t seed = 1;
  uint64_t first = 0;
  std::string only;
  std::string replay;
  std::string save_in = ".";
  bool pretend_crash = false;
};

struct Counts {
  std::atomic<uint64_t> accepted, rejected;
  std::atomic<uint64_t> slowest_us;
};

// Shared memory of both processes. Inputs are stored there before they are read, so that they survive a crash.
struct Shared {
  std::atomic<uint64_t> input;  // number of the current input
  std::atomic<bool> finished;
  size_t reader;
  size_t size;
  char bytes[kMaxMutant];
  Counts counts[64];
};

constexpr auto kHang = std::chrono::seconds(20);  // an input takes milliseconds, even on a busy machine

void ReadOne(const FuzzReader& reader, size_t index, uint64_t number, const std::string& bytes, Shared& shared) {
  shared.reader = index;
  shared.size = std::min(bytes.size(), kMaxMutant);
  std::memcpy(shared.bytes, bytes.data(), shared.size);
  shared.input = number + 1;
  const auto begin = Clock::now();
  const bool ok = reader.read(bytes).ok();
  const auto spent = std::chrono::duration_cast<std::chrono::microseconds>(Clock::now() - begin).count();
  Counts& counts = shared.counts[index];
  ++(ok ? counts.accepted : counts.rejected);
  counts.slowest_us = std::max(counts.slowest_us.load(), static_cast<uint64_t>(spent));
}

// The child's work.
int Work(const Options& options, const fs::path& folder, Shared& shared) {
  std::vector<FuzzReader> readers = FuzzReaders(folder);
  if (!options.only.empty()) {
    std::erase_if(readers, [&](const FuzzReader& r) { return r.name != options.only; });
  }
  if (readers.empty() || readers.size() > std::size(shared.counts)) {
    std::fprintf(stderr, "no reader \"%s\"\n", options.only.c_str());
    return 2;
  }
  if (!options.replay.empty()) {
    std::ifstream in(options.replay, std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
    for (size_t r = 0; r < readers.size(); ++r) ReadOne(readers[r], r, 0, bytes, shared);
    shared.finished = true;
    return 0;
  }
  // A rejected seed tests nothing.
  for (size_t r = 0; r < readers.size(); ++r) {
    for (const std::string& seed : readers[r].seeds) {
      if (const Status status = readers[r].read(seed); !status.ok()) {
        std::fprintf(stderr, "%s: a good file is refused: %s\n", readers[r].name.c_str(),
                     status.error().message.c_str());
        return 2;
      }
    }
  }
  if (options.pretend_crash) readers.back().read = [](const std::string&) -> Status { std::abort(); };
  const auto end = Clock::now() + std::chrono::duration<double>(options.seconds);
  for (uint64_t k = options.first; options.seconds > 0 ? Clock::now() < end : k < options.first + options.inputs; ++k) {
    const size_t r = static_cast<size_t>(k % readers.size());
    // Each input has its own generator, so that it can be reproduced alone.
    Random random(options.seed * 0x9E3779B97F4A7C15u + k);
    ReadOne(readers[r], r, k, Mutate(readers[r].seeds, readers[r].words, random), shared);
  }
  for (size_t r = 0; r < readers.size(); ++r) {
    const Counts& c = shared.counts[r];
    std::printf("%-20s %9s inputs %9s accepted %9s rejected   slowest %.1f ms\n", readers[r].name.c_str(),
                WithThousands(static_cast<int64_t>(c.accepted + c.rejected)).c_str(),
                WithThousands(static_cast<int64_t>(c.accepted)).c_str(),
                WithThousands(static_cast<int64_t>(c.rejected)).c_str(), static_cast<double>(c.slowest_us) / 1000);
  }
  shared.finished = true;
  return 0;
}

int Report(const Options& options, const char* what, const Shared& shared) {
  const uint64_t number = shared.input;
  if (number == 0) {
    std::fprintf(stderr, "the reader process %s before the first input\n", what);
    return 1;
  }
  const fs::path file = fs::path(options.save_in) / Cat("fuzz-crash-", options.seed, "-", number - 1, ".bin");
  std::ofstream(file, std::ios::binary).write(shared.bytes, static_cast<std::streamsize>(shared.size));
  std::fprintf(stderr,
               "reader number %zu %s at input %llu of seed %llu (%zu bytes, saved as %s)\n"
               "again: fuzz_readers --seed %llu --first %llu --inputs 1%s%s\n",
               shared.reader, what, static_cast<unsigned long long>(number - 1),
               static_cast<unsigned long long>(options.seed), shared.size, file.c_str(),
               static_cast<unsigned long long>(options.seed), static_cast<unsigned long long>(number - 1),
               options.only.empty() ? "" : " --only ", options.only.c_str());
  return 1;
}

int Supervise(const Options& options, pid_t child, const Shared& shared) {
  uint64_t last = 0;
  auto since = Clock::now();
  for (;;) {
    int status = 0;
    const pid_t ended = ::waitpid(child, &status, WNOHANG);
    if (ended == child) {
      if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return 0;
      if (WIFEXITED(status) && WEXITSTATUS(status) == 2) return 2;
      if (shared.finished) {  // the sanitizer's final report on all inputs
        std::fprintf(stderr, "the reader process ended badly after its last input (a leak?)\n");
        return 1;
      }
      return Report(options, "crashed", shared);
    }
    const uint64_t now = shared.input;
    if (now != last || shared.finished) {
      last = now;
      since = Clock::now();
    } else if (Clock::now() - since > kHang && now > 0) {
      ::kill(child, SIGKILL);
      ::waitpid(child, &status, 0);
      return Report(options, "hung", shared);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}

// In memory if possible, as most readers read by path.
fs::path MakeFolder() {
  const fs::path memory = "/dev/shm";
  const bool usable = ::access(memory.c_str(), W_OK) == 0;
  std::string name = ((usable ? memory : fs::temp_directory_path()) / "anchorsplat-fuzz-XXXXXX").string();
  return mkdtemp(name.data()) != nullptr ? fs::path(name) : fs::path();
}

int Main(int argc, char** argv) {
  Options options;
  CLI::App app("Damaged files against every reader; fails when one crashes, hangs or asks for far too much memory.");
  app.add_option("--inputs", options.inputs, "how many damaged files")->capture_default_str();
  app.add_option("--seconds", options.seconds, "for how long, instead of --inputs");
  app.add_option("--seed", options.seed, "another seed, other files")->capture_default_str();
  app.add_option("--first", options.first, "number of the first file")->capture_default_str();
  app.add_option("--only", options.only, "the reader of this name only");
  app.add_option("--replay", options.replay, "a saved file instead of damaged ones")->check(CLI::ExistingFile);
  app.add_option("--save-in", options.save_in, "folder for inputs that crash")->check(CLI::ExistingDirectory);
  app.add_flag("--pretend-crash", options.pretend_crash, "the last reader crashes, to see that it would be noticed");
  CLI11_PARSE(app, argc, argv);

  void* memory = ::mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  const fs::path folder = MakeFolder();
  if (memory == MAP_FAILED || folder.empty()) {
    std::fprintf(stderr, "cannot make room for the inputs\n");
    return 2;
  }
  auto* shared = new (memory) Shared;  // zero pages are its initial state
  const pid_t child = ::fork();        // before any thread is started
  if (child == 0) std::exit(Work(options, folder, *shared));
  const int code = child < 0 ? 2 : Supervise(options, child, *shared);
  std::error_code ignored;
  fs::remove_all(folder, ignored);
  return code;
}

}  // namespace
}  // namespace anchorsplat

int main(int argc, char** argv) { return anchorsplat::Main(argc, argv); }
