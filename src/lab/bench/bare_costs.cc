#include "bench/bare_costs.h"

#include <fcntl.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "core/text.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

// Anonymous memory of this process in bytes; 0 if unknown.
uint64_t AnonymousBytes() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    if (word != "RssAnon:") continue;
    uint64_t kibibytes = 0;
    status >> kibibytes;
    return kibibytes * 1024;
  }
  return 0;
}

}  // namespace

double Seconds(const std::function<void()>& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

uint64_t PeakGrowth(const std::function<void()>& work) {
#ifdef __GLIBC__
  malloc_trim(0);  // reused free memory would not show as growth
#endif
  const uint64_t before = AnonymousBytes();
  std::atomic<bool> done{false};
  std::atomic<uint64_t> peak{before};
  std::thread sampler([&] {
    while (!done) {
      peak = std::max(peak.load(), AnonymousBytes());
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  });
  work();
  const uint64_t after = AnonymousBytes();
  done = true;
  sampler.join();
  return std::max(peak.load(), after) - before;
}

Status ReadToNowhere(const fs::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return Error{ErrorCode::kIo, Cat(path.string(), ": cannot open")};
  std::vector<char> block(size_t{128} << 10);  // block size of cat
  while (::read(descriptor, block.data(), block.size()) > 0) {
  }
  ::close(descriptor);
  return {};
}

Status WriteBare(const fs::path& path, const char* bytes, uint64_t size) {
  const int descriptor = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  bool ok = descriptor >= 0;
  for (uint64_t at = 0; ok && at < size;) {
    const ssize_t n = ::write(descriptor, bytes + at, std::min<uint64_t>(size - at, uint64_t{1} << 20));
    ok = n > 0;
    at += static_cast<uint64_t>(std::max<ssize_t>(n, 0));
  }
  if (descriptor >= 0) ok = ::close(descriptor) == 0 && ok;
  if (!ok) return Error{ErrorCode::kIo, Cat(path.string(), ": cannot write")};
  return {};
}

Status CopyToFreshPages(const char* bytes, uint64_t size) {
  void* pages = ::mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (pages == MAP_FAILED) return Error{ErrorCode::kIo, Cat("no memory for a copy of ", HumanBytes(size))};
  std::memcpy(pages, bytes, size);
  ::munmap(pages, size);
  return {};
}

Result<ScratchFolder> ScratchFolder::Make(const std::filesystem::path& parent, uint64_t needed, const char* who) {
  std::error_code failed;
  const std::filesystem::path where = parent.empty() ? std::filesystem::temp_directory_path(failed) : parent;
  const std::filesystem::space_info space = std::filesystem::space(where, failed);
  if (failed || space.available < needed) {
    return Error{ErrorCode::kIo,
                 Cat(where.string(), ": ", who, " needs ", HumanBytes(needed), " of free space, there is ",
                     failed ? std::string("no such folder") : HumanBytes(space.available))};
  }
  ScratchFolder folder;
  std::string name = (where / "anchorsplat-bench-XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) {
    return Error{ErrorCode::kIo, Cat(where.string(), ": cannot make a folder in it")};
  }
  folder.path_ = name;
  return folder;
}

ScratchFolder::ScratchFolder(ScratchFolder&& other) noexcept : path_(std::exchange(other.path_, {})) {}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
}

}  // namespace anchorsplat
