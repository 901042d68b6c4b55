#pragma once

#include <filesystem>

#include "core/result.h"

namespace anchorsplat {

// A file that one process at a time may hold. The system lets go of it when the process ends, however it does, so that
// nothing is left to clear away.
class FileLock {
 public:
  // kExists when another process holds it and `wait` is false; kIo.
  static Result<FileLock> Take(const std::filesystem::path& path, bool wait);
  // The same, without waiting, of a file that is gone when the lock is let go: beside what people look at.
  static Result<FileLock> TakeAndRemove(const std::filesystem::path& path);
  FileLock(FileLock&& other) noexcept;
  FileLock& operator=(FileLock&&) = delete;
  ~FileLock();

 private:
  FileLock() = default;
  int descriptor_ = -1;
  std::filesystem::path remove_;  // at the end; empty: it stays
};

}  // namespace anchorsplat
