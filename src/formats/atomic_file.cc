#include "formats/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <system_error>
#include <utility>

#include "core/text.h"

namespace anchorsplat {

namespace {

std::string Reason(int error) { return std::generic_category().message(error); }

Error WriteError(const std::filesystem::path& path, const char* what, int error) {
  return {ErrorCode::kIo, Cat(path.string(), ": cannot ", what, ": ", Reason(error))};
}

Error Exists(const std::filesystem::path& path) {
  return {ErrorCode::kExists, Cat(path.string(), ": exists already and would be overwritten")};
}

// Short and independent of the final name, which may be as long as the file system allows.
std::string TemporaryName() {
  static std::atomic<uint64_t> counter{0};
  return Cat(".anchorsplat-", ::getpid(), "-", counter.fetch_add(1), ".partial");
}

// A file without a name, which the system removes by itself however the process ends; −1 where the file system or the
// absence of /proc, through which it will be named, does not allow it.
int OpenNameless([[maybe_unused]] const std::filesystem::path& folder) {
#ifdef O_TMPFILE
  if (::access("/proc/self/fd", X_OK) == 0) return ::open(folder.c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0666);
#endif
  return -1;
}

// Gives a nameless file its first name; refuses to replace. An errno.
int NameTheNameless(int descriptor, const std::filesystem::path& name) {
  const std::string link = Cat("/proc/self/fd/", descriptor);
  return ::linkat(AT_FDCWD, link.c_str(), AT_FDCWD, name.c_str(), AT_SYMLINK_FOLLOW) == 0 ? 0 : errno;
}

// rename() that refuses to replace. The flag is not known to every file system; there, look and rename.
int RenameToNewName(const char* from, const char* to) {
#ifdef RENAME_NOREPLACE
  if (::renameat2(AT_FDCWD, from, AT_FDCWD, to, RENAME_NOREPLACE) == 0) return 0;
  if (errno != EINVAL && errno != ENOSYS) return errno;
#endif
  struct stat info {};
  if (::lstat(to, &info) == 0) return EEXIST;
  return ::rename(from, to) == 0 ? 0 : errno;
}

}  // namespace

Result<OutputFile> OutputFile::Create(const std::filesystem::path& path, bool overwrite) {
  if (path.empty() || !path.has_filename()) {
    return Error{ErrorCode::kBadArgument, Cat("\"", path.string(), "\" is not the name of a file to write")};
  }
  OutputFile file;
  file.path_ = path;
  file.target_ = path;
  file.overwrite_ = overwrite;

  mode_t mode = 0666;  // less the umask, like any new file
  struct stat info {};
  const bool exists = ::stat(path.c_str(), &info) == 0;
  if (exists) {
    if (S_ISDIR(info.st_mode)) return Error{ErrorCode::kIo, Cat(path.string(), ": is a folder, not a file to write")};
    if (!overwrite) return Exists(path);
    if (!S_ISREG(info.st_mode)) {
      return Error{ErrorCode::kIo, Cat(path.string(), ": is not a regular file and cannot be replaced by one")};
    }
    mode = info.st_mode & 0777;
    // Renaming onto a symbolic link would replace the link and leave the file it names as it was.
    std::error_code ignored;
    if (auto real = std::filesystem::canonical(path, ignored); !ignored) file.target_ = std::move(real);
  }

  std::filesystem::path folder = file.target_.parent_path();
  if (folder.empty()) folder = ".";
  file.descriptor_ = OpenNameless(folder);
  while (file.descriptor_ < 0) {  // a name left over by a killed process with our number is skipped
    file.temporary_ = folder / TemporaryName();
    file.descriptor_ = ::open(file.temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (file.descriptor_ < 0 && errno != EEXIST && errno != EINTR) break;
  }
  if (file.descriptor_ < 0) {
    const int error = errno;
    file.temporary_.clear();
    std::error_code unknown;
    if ((error == ENOENT || error == ENOTDIR) && !std::filesystem::is_directory(folder, unknown)) {
      return Error{ErrorCode::kNotFound, Cat(path.string(), ": its folder ", folder.string(), " does not exist")};
    }
    return WriteError(path, "create a file in its folder", error);
  }
  if (exists) (void)::fchmod(file.descriptor_, mode);  // the replaced file's permissions, where we may set them
  return file;
}

OutputFile::OutputFile(OutputFile&& other) noexcept { *this = std::move(other); }

OutputFile& OutputFile::operator=(OutputFile&& other) noexcept {
  if (this == &other) return *this;
  Discard();
  path_ = std::move(other.path_);
  target_ = std::move(other.target_);
  temporary_ = std::exchange(other.temporary_, {});
  descriptor_ = std::exchange(other.descriptor_, -1);
  overwrite_ = other.overwrite_;
  written_ = other.written_;
  return *this;
}

OutputFile::~OutputFile() { Discard(); }

void OutputFile::Discard() noexcept {
  if (descriptor_ >= 0) ::close(descriptor_);
  descriptor_ = -1;
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
  temporary_.clear();
}

Status OutputFile::Reserve(uint64_t bytes) {
#ifdef FALLOC_FL_KEEP_SIZE
  if (::fallocate(descriptor_, FALLOC_FL_KEEP_SIZE, 0, static_cast<off_t>(bytes)) != 0 && errno == ENOSPC) {
    return Error{ErrorCode::kIo,
                 Cat(path_.string(), ": cannot write ", HumanBytes(bytes), ": no space left on the device")};
  }
#else
  (void)bytes;
#endif
  return {};
}

Status OutputFile::Write(const void* data, size_t size) {
  ANCHORSPLAT_RETURN_IF_ERROR(WriteAt(written_, data, size));
  written_ += size;
  return {};
}

Status OutputFile::WriteAt(uint64_t offset, const void* data, size_t size) const {
  const char* from = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t n = ::pwrite(descriptor_, from, size, static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return WriteError(path_, "write", errno);
    from += n;
    offset += static_cast<uint64_t>(n);
    size -= static_cast<size_t>(n);
  }
  return {};
}

Status OutputFile::Commit() {
  if (temporary_.empty()) {  // nameless so far
    int error = 0;
    if (overwrite_) {  // a name for an instant: only rename() replaces
      const std::filesystem::path name = target_.parent_path() / TemporaryName();
      error = NameTheNameless(descriptor_, name);
      if (error == 0) temporary_ = name;
    } else {
      error = NameTheNameless(descriptor_, target_);
    }
    if (error != 0) {
      Discard();
      return error == EEXIST ? Exists(path_) : WriteError(path_, "give the file its name", error);
    }
    if (!overwrite_) {
      const int closed = ::close(std::exchange(descriptor_, -1));
      return closed == 0 || errno == EINTR ? Status() : Status(WriteError(path_, "write", errno));
    }
  }
  // close() is where network file systems report what they could not write.
  const int closed = ::close(std::exchange(descriptor_, -1));
  if (closed != 0 && errno != EINTR) {
    const int error = errno;
    Discard();
    return WriteError(path_, "write", error);
  }
  const int error = overwrite_ ? (::rename(temporary_.c_str(), target_.c_str()) == 0 ? 0 : errno)
                               : RenameToNewName(temporary_.c_str(), target_.c_str());
  if (error == 0) {
    temporary_.clear();
    return {};
  }
  Discard();
  if (error == EEXIST) return Exists(path_);
  return WriteError(path_, "give the file its name", error);
}

Status CommitTogether(std::span<OutputFile> files) {
  for (size_t k = 0; k < files.size(); ++k) {
    const Status status = files[k].Commit();
    if (status.ok()) continue;
    std::error_code ignored;
    for (size_t named = 0; named < k; ++named) std::filesystem::remove(files[named].path(), ignored);
    return status;
  }
  return {};
}

Status CheckWritable(const std::filesystem::path& path) {
  const auto file = OutputFile::Create(path, /*overwrite=*/true);
  return file.ok() ? Status() : Status(file.error());
}

Status WriteWholeFile(const std::filesystem::path& path, std::string_view bytes, bool overwrite) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(OutputFile file, OutputFile::Create(path, overwrite));
  ANCHORSPLAT_RETURN_IF_ERROR(file.Write(bytes));
  return file.Commit();
}

}  // namespace anchorsplat
