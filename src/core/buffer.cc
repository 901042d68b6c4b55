#include "core/buffer.h"

#include <sys/mman.h>

#include <cstdlib>

namespace anchorsplat::internal {

namespace {
constexpr std::size_t kAlignment = 64;  // one cache line, one AVX-512 register
constexpr std::size_t kHugePage = std::size_t{2} << 20;
constexpr std::size_t kHugeFrom = 2 * kHugePage;  // below this the rounding would waste too much
}  // namespace

void* AllocateBuffer(std::size_t bytes) {
  if (bytes == 0) bytes = 1;
  const std::size_t alignment = bytes >= kHugeFrom ? kHugePage : kAlignment;
  void* memory = nullptr;
  if (posix_memalign(&memory, alignment, bytes) != 0) throw std::bad_alloc();
#ifdef MADV_HUGEPAGE
  // Only whole huge pages inside the block: advice on the ragged end would spill over to a neighbour.
  if (bytes >= kHugeFrom) (void)madvise(memory, bytes / kHugePage * kHugePage, MADV_HUGEPAGE);
#endif
  return memory;
}

void FreeBuffer(void* memory, std::size_t) noexcept { std::free(memory); }

}  // namespace anchorsplat::internal
