#include "io/file_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
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

Result<FileLock> FileLock::TakeAndRemove(const std::filesystem::path& path) {
  for (;;) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(FileLock lock, Take(path, false));
    struct stat held {
    }, named{};
    // The previous holder may have removed the file after we opened it; then the name refers to another one.
    if (::fstat(lock.descriptor_, &held) == 0 && ::stat(path.c_str(), &named) == 0 && held.st_ino == named.st_ino) {
      lock.remove_ = path;
      return lock;
    }
  }
}

FileLock::FileLock(FileLock&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)), remove_(std::move(other.remove_)) {
  other.remove_.clear();
}

FileLock::~FileLock() {
  if (descriptor_ < 0) return;
  if (!remove_.empty()) ::unlink(remove_.c_str());
  ::close(descriptor_);
}

}  // namespace anchorsplat
