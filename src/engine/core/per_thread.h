#pragma once

#ifdef ANCHORSPLAT_WORKERS
#include <pthread.h>
#endif

namespace anchorsplat {

// The calling thread's T, created on first use: scratch memory that a loop's body keeps between calls. Code that shares
// T shares the object; use a type of your own to avoid that.
template <typename T>
T& PerThread() {
#ifdef ANCHORSPLAT_WORKERS
  // Not thread_local: in modules linked without threads, LLVM 19's linker overlaps such variables with other data.
  static const pthread_key_t key = [] {
    pthread_key_t made{};
    pthread_key_create(&made, [](void* kept) { delete static_cast<T*>(kept); });
    return made;
  }();
  if (void* const kept = pthread_getspecific(key)) return *static_cast<T*>(kept);
  T* const made = new T();
  pthread_setspecific(key, made);
  return *made;
#else
  thread_local T kept;
  return kept;
#endif
}

}  // namespace anchorsplat
