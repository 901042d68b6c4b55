#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <new>
#include <string>

namespace anchorsplat {

// Limits the memory of Buffers of 4 MiB and more. Buffers beyond the limit live in unnamed temporary files, mapped into
// the address space: results are bit-identical, and the system reclaims their pages under memory pressure. Disk space
// is reserved on allocation, so a full disk throws DiskFull instead of raising SIGBUS later. Unnamed files vanish
// however the process ends; file systems without them show a name for a moment.
//
// Process-wide, one at a time. Buffers may outlive the limit and stay where they are.
class MemoryLimit {
 public:
  // `bytes`: limit on all Buffers together. Buffers of 64 MiB and more may use half of it, as smaller ones are in
  // heavier use. `folder`: of the temporary files.
  MemoryLimit(uint64_t bytes, std::filesystem::path folder);
  ~MemoryLimit();
  MemoryLimit(const MemoryLimit&) = delete;
  MemoryLimit& operator=(const MemoryLimit&) = delete;

  // Peak bytes on disk since construction.
  uint64_t most_on_disk() const;
};

// Memory of the machine, or of the process's control group if that is less, in bytes.
uint64_t MachineMemory();

// Thrown if a temporary file cannot hold a Buffer.
class DiskFull : public std::bad_alloc {
 public:
  DiskFull(uint64_t bytes, const std::filesystem::path& folder, int error);
  const char* what() const noexcept override { return message_.c_str(); }

 private:
  std::string message_;
};

namespace internal {

inline constexpr std::size_t kLimitedFrom = std::size_t{4} << 20;

// Hooks of AllocateBuffer and FreeBuffer for sizes from kLimitedFrom on.
struct LimitedPlace {
  void* mapped = nullptr;  // null: allocate memory
  bool counted = false;    // call SettleLimited with the memory
};
LimitedPlace ClaimLimited(std::size_t bytes);
// Reports the memory allocated after a counted claim; null if the allocation failed.
void SettleLimited(void* memory, std::size_t bytes) noexcept;
// Whether the Buffer was mapped; it is then unmapped.
bool ReleaseLimited(void* memory, std::size_t bytes) noexcept;

}  // namespace internal

}  // namespace anchorsplat
