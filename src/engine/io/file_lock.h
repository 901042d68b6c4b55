#pragma once

#include <filesystem>

#include "core/result.h"

namespace anchorsplat {

// Lock file that one process can hold at a time. The system releases it however the process ends.
class FileLock {
 public:
  // Errors: kExists: held by another process and `wait` is false; kIo.
  static Result<FileLock> Take(const std::filesystem::path& path, bool wait);
  // The same without waiting; the file is removed with the lock, so that users do not see it beside their files.
  static Result<FileLock> TakeAndRemove(const std::filesystem::path& path);
  FileLock(FileLock&& other) noexcept;
  FileLock& operator=(FileLock&&) = delete;
  ~FileLock();

 private:
  FileLock() = default;
  int descriptor_ = -1;
  std::filesystem::path remove_;  // removed on release, unless empty
};

}  // namespace anchorsplat
