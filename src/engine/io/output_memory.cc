#include "io/output_memory.h"

#include <cstring>
#include <mutex>

namespace anchorsplat {

void MemoryBytes::Reserve(uint64_t size) {
  const std::unique_lock lock(mutex_);
  bytes_.reserve(static_cast<size_t>(size));
}

void MemoryBytes::WriteAt(uint64_t offset, const void* data, size_t size) {
  if (size == 0) return;
  const auto begin = static_cast<size_t>(offset), end = begin + size;
  {
    const std::shared_lock lock(mutex_);
    if (end <= bytes_.size()) {
      std::memcpy(bytes_.data() + begin, data, size);
      return;
    }
  }
  const std::unique_lock lock(mutex_);
  if (end > bytes_.size()) bytes_.resize(end);
  std::memcpy(bytes_.data() + begin, data, size);
}

}  // namespace anchorsplat
