#pragma once

#include <cstddef>
#include <memory>
#include <new>
#include <utility>
#include <vector>

namespace anchorsplat {

namespace internal {
// Allocates 64-byte aligned memory. From 4 MiB on it is 2 MiB-aligned and eligible for huge pages, because touching
// hundreds of megabytes of fresh 4 KiB pages costs more than copying into them.
void* AllocateBuffer(std::size_t bytes);
void FreeBuffer(void* memory, std::size_t bytes) noexcept;
}  // namespace internal

// Allocator that leaves new elements uninitialised, for arrays that are filled right away.
template <typename T>
struct UninitializedAllocator {
  using value_type = T;
  UninitializedAllocator() = default;
  template <typename U>
  UninitializedAllocator(const UninitializedAllocator<U>&) {}  // NOLINT: rebinding conversion

  T* allocate(std::size_t n) {
    if (n > static_cast<std::size_t>(-1) / sizeof(T)) throw std::bad_array_new_length();
    return static_cast<T*>(internal::AllocateBuffer(n * sizeof(T)));
  }
  void deallocate(T* p, std::size_t n) noexcept { internal::FreeBuffer(p, n * sizeof(T)); }

  template <typename U>
  void construct(U* p) {
    ::new (static_cast<void*>(p)) U;  // default-initialisation: no work for numbers
  }
  template <typename U, typename... Args>
  void construct(U* p, Args&&... args) {
    ::new (static_cast<void*>(p)) U(std::forward<Args>(args)...);
  }
  friend bool operator==(const UninitializedAllocator&, const UninitializedAllocator&) { return true; }
};

// std::vector for bulk numbers: resize() leaves new elements uninitialised.
template <typename T>
using Buffer = std::vector<T, UninitializedAllocator<T>>;

}  // namespace anchorsplat
