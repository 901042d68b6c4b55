#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <new>
#include <string>

namespace anchorsplat {

// Bounds the memory of Buffers of 4 MiB and more. Those for which there is no room lie in files without names in a
// folder, mapped into the address space: nothing else in the program changes, results have the same bits, and the
// system takes the memory of such pages back whenever somebody else needs it. The disk space is claimed when a Buffer
// is made, so that a full disk is a NoDiskRoom and no SIGBUS later. However the process ends, nothing of the files
// stays, as they never had names (where the file system has no such files: for a moment).
//
// Process-wide and one at a time; Buffers may outlive it and stay where they are.
class MemoryLimit {
 public:
  // `bytes` of Buffers at once; the largest ones (64 MiB and more) get half of it, as the others are in more use.
  MemoryLimit(uint64_t bytes, std::filesystem::path folder);
  ~MemoryLimit();
  MemoryLimit(const MemoryLimit&) = delete;
  MemoryLimit& operator=(const MemoryLimit&) = delete;

  // The most that lay on disk at a time since it began, in bytes.
  uint64_t most_on_disk() const;
};

// What the system, or the control group that the process runs in, has.
uint64_t MachineMemory();

// There is no room for a Buffer on disk either.
class NoDiskRoom : public std::bad_alloc {
 public:
  NoDiskRoom(uint64_t bytes, const std::filesystem::path& folder, int error);
  const char* what() const noexcept override { return message_.c_str(); }

 private:
  std::string message_;
};

namespace internal {

inline constexpr std::size_t kLimitedFrom = std::size_t{4} << 20;

// What AllocateBuffer and FreeBuffer ask for sizes from kLimitedFrom on.
struct LimitedPlace {
  void* mapped = nullptr;  // null: it shall be memory
  bool counted = false;    // which then has to be settled
};
LimitedPlace ClaimLimited(std::size_t bytes);
// Where the memory is; null: there was none.
void SettleLimited(void* memory, std::size_t bytes) noexcept;
// Whether the Buffer was mapped, and is gone now.
bool ReleaseLimited(void* memory, std::size_t bytes) noexcept;

}  // namespace internal

}  // namespace anchorsplat
