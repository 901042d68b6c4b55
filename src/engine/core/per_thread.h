#pragma once

#ifdef ANCHORSPLAT_WORKERS
#include <pthread.h>
#endif

namespace anchorsplat {

// One T for each thread, made when the thread first asks: what a loop's body keeps from call to call. There is one for
// each type, so who wants one of their own gives it a type of their own.
template <typename T>
T& PerThread() {
#ifdef ANCHORSPLAT_WORKERS
  // Not thread_local: where a module is linked without threads, LLVM 19's linker puts such variables over other data.
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
