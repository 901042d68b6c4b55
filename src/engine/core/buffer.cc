#include "core/buffer.h"

#ifndef __EMSCRIPTEN__
#include <sys/mman.h>
#endif

#include <cstdlib>

#include "core/memory_limit.h"

namespace anchorsplat::internal {

namespace {
constexpr std::size_t kAlignment = 64;  // one cache line, one AVX-512 register
constexpr std::size_t kHugePage = std::size_t{2} << 20;
#ifdef MADV_HUGEPAGE
constexpr std::size_t kHugeFrom = 2 * kHugePage;  // below this the rounding would waste too much
#else
constexpr std::size_t kHugeFrom = static_cast<std::size_t>(-1);  // there are none
#endif
}  // namespace

void* AllocateBuffer(std::size_t bytes) {
  if (bytes == 0) bytes = 1;
  const std::size_t alignment = bytes >= kHugeFrom ? kHugePage : kAlignment;
  const LimitedPlace place = bytes >= kLimitedFrom ? ClaimLimited(bytes) : LimitedPlace{};
  if (place.mapped != nullptr) return place.mapped;
  void* memory = nullptr;
  const bool made = posix_memalign(&memory, alignment, bytes) == 0;
  if (place.counted) SettleLimited(made ? memory : nullptr, bytes);
  if (!made) throw std::bad_alloc();
#ifdef MADV_HUGEPAGE
  // Only whole huge pages inside the block: advice on the ragged end would spill over to a neighbour.
  if (bytes >= kHugeFrom) (void)madvise(memory, bytes / kHugePage * kHugePage, MADV_HUGEPAGE);
#endif
  return memory;
}

void FreeBuffer(void* memory, std::size_t bytes) noexcept {
  if (bytes >= kLimitedFrom && ReleaseLimited(memory, bytes)) return;
  std::free(memory);
}

}  // namespace anchorsplat::internal
