#include "dataset/file_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "core/text.h"

namespace anchorsplat {

Result<FileLock> FileLock::Take(const std::filesystem::path& path, bool wait) {
  FileLock lock;
  lock.descriptor_ = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (lock.descriptor_ < 0) {
    return Error{ErrorCode::kIo, Cat(path.string(), ": cannot write: ", std::strerror(errno))};
  }
  int result = 0;
  do {
    result = ::flock(lock.descriptor_, LOCK_EX | (wait ? 0 : LOCK_NB));
  } while (result != 0 && errno == EINTR);
  if (result == 0) return lock;
  if (errno == EWOULDBLOCK) return Error{ErrorCode::kExists, Cat(path.string(), ": held by another process")};
  return Error{ErrorCode::kIo, Cat(path.string(), ": cannot lock: ", std::strerror(errno))};
}

FileLock::FileLock(FileLock&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}

FileLock::~FileLock() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

}  // namespace anchorsplat
