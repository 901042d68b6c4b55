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
  FileLock(FileLock&& other) noexcept;
  FileLock& operator=(FileLock&&) = delete;
  ~FileLock();

 private:
  FileLock() = default;
  int descriptor_ = -1;
};

}  // namespace anchorsplat
