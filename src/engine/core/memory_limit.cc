#include "core/memory_limit.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <mutex>
#include <system_error>
#include <unordered_map>
#include <utility>

#include "core/text.h"

namespace anchorsplat {

namespace {

constexpr std::size_t kLargeBuffer = std::size_t{64} << 20;

struct LimitedBuffers {
  std::mutex mutex;
  bool active = false;
  uint64_t most = 0;  // bytes of memory
  std::filesystem::path folder;
  uint64_t in_memory = 0, on_disk = 0, most_on_disk = 0;
  std::unordered_map<void*, std::size_t> counted;  // in memory
  std::unordered_map<void*, std::size_t> mapped;
};

// Never destroyed: static objects may free Buffers after it.
LimitedBuffers& BuffersNow() {
  static LimitedBuffers* const limit = new LimitedBuffers;
  return *limit;
}

// False until the first MemoryLimit: Buffers then take the fast path.
std::atomic<bool> ever_limited = false;

// Opens an unnamed file; −1 with errno on failure.
int OpenNameless(const std::filesystem::path& folder) {
#ifdef O_TMPFILE
  const int descriptor = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (descriptor >= 0) return descriptor;
#endif
  std::string name = (folder / ".anchorsplat-XXXXXX").string();
  const int named = ::mkostemp(name.data(), O_CLOEXEC);
  if (named >= 0) ::unlink(name.c_str());
  return named;
}

void* MapNameless(const std::filesystem::path& folder, std::size_t bytes) {
  const int descriptor = OpenNameless(folder);
  if (descriptor < 0) throw DiskFull(bytes, folder, errno);
  int error;
  do {
    error = ::posix_fallocate(descriptor, 0, static_cast<off_t>(bytes));
  } while (error == EINTR);
  void* memory = MAP_FAILED;
  if (error == 0) {
    memory = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0);
    if (memory == MAP_FAILED) error = errno;
  }
  ::close(descriptor);  // the mapping holds the file
  if (error != 0) throw DiskFull(bytes, folder, error);
  return memory;
}

// First number in a file; the largest number if there is none ("max").
uint64_t NumberIn(const char* path) {
  uint64_t number = 0;
  std::ifstream file(path);
  return file >> number ? number : std::numeric_limits<uint64_t>::max();
}

}  // namespace

DiskFull::DiskFull(uint64_t bytes, const std::filesystem::path& folder, int error)
    : message_(Cat("no room for ", HumanBytes(bytes), " of temporary files in ", folder.string(), ": ",
                   std::generic_category().message(error), " (a larger --max-memory needs less)")) {}

uint64_t MachineMemory() {
  const long pages = ::sysconf(_SC_PHYS_PAGES), page = ::sysconf(_SC_PAGESIZE);
  uint64_t bytes =
      pages > 0 && page > 0 ? static_cast<uint64_t>(pages) * static_cast<uint64_t>(page) : uint64_t{4} << 30;
  for (const char* path : {"/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"}) {
    bytes = std::min(bytes, NumberIn(path));
  }
  return bytes;
}

MemoryLimit::MemoryLimit(uint64_t bytes, std::filesystem::path folder) {
  LimitedBuffers& limit = BuffersNow();
  const std::lock_guard lock(limit.mutex);
  limit.active = true;
  limit.most = bytes;
  limit.folder = folder.empty() ? std::filesystem::path(".") : std::move(folder);
  limit.most_on_disk = limit.on_disk;
  ever_limited = true;
}

MemoryLimit::~MemoryLimit() {
  LimitedBuffers& limit = BuffersNow();
  const std::lock_guard lock(limit.mutex);
  limit.active = false;
}

uint64_t MemoryLimit::most_on_disk() const {
  LimitedBuffers& limit = BuffersNow();
  const std::lock_guard lock(limit.mutex);
  return limit.most_on_disk;
}

namespace internal {

LimitedPlace ClaimLimited(std::size_t bytes) {
  if (!ever_limited) return {};
  LimitedBuffers& limit = BuffersNow();
  const std::lock_guard lock(limit.mutex);
  if (!limit.active) return {};
  if (limit.in_memory + bytes <= (bytes >= kLargeBuffer ? limit.most / 2 : limit.most)) {
    limit.in_memory += bytes;
    return {nullptr, true};
  }
  void* const memory = MapNameless(limit.folder, bytes);
  limit.mapped.emplace(memory, bytes);
  limit.on_disk += bytes;
  limit.most_on_disk = std::max(limit.most_on_disk, limit.on_disk);
  return {memory, false};
}

void SettleLimited(void* memory, std::size_t bytes) noexcept {
  LimitedBuffers& limit = BuffersNow();
  const std::lock_guard lock(limit.mutex);
  if (memory == nullptr) {
    limit.in_memory -= bytes;
  } else {
    limit.counted.emplace(memory, bytes);
  }
}

bool ReleaseLimited(void* memory, std::size_t bytes) noexcept {
  if (!ever_limited) return false;
  LimitedBuffers& limit = BuffersNow();
  {
    const std::lock_guard lock(limit.mutex);
    if (limit.counted.erase(memory) > 0) limit.in_memory -= bytes;
    if (limit.mapped.erase(memory) == 0) return false;
    limit.on_disk -= bytes;
  }
  (void)::munmap(memory, bytes);
  return true;
}

}  // namespace internal

}  // namespace anchorsplat
