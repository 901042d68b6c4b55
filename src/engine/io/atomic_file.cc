#include "io/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <system_error>
#include <utility>

#include "core/run_context.h"
#include "core/text.h"
#include "io/input_record.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

std::string Reason(int error) { return std::generic_category().message(error); }

Error WriteError(const fs::path& path, const char* what, int error) {
  return {ErrorCode::kIo, Cat(path.string(), ": cannot ", what, ": ", Reason(error))};
}

Error AlreadyThere(const fs::path& path) {
  return {ErrorCode::kExists, Cat(path.string(), ": exists; -w replaces it")};
}

// Short and independent of the final name, which may be as long as the file system allows.
std::string TemporaryName() {
  static std::atomic<uint64_t> counter{0};
  return Cat(".anchorsplat-", ::getpid(), "-", counter.fetch_add(1), ".partial");
}

// Opens an unnamed file, which vanishes however the process ends. −1 if the file system does not support it, or without
// /proc, which is needed to name it.
int OpenNameless([[maybe_unused]] const fs::path& folder) {
#ifdef O_TMPFILE
  if (::access("/proc/self/fd", X_OK) == 0) return ::open(folder.c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0666);
#endif
  return -1;
}

// Links an O_TMPFILE file to `name` without replacing; returns 0 or errno.
int NameTheNameless(int descriptor, const fs::path& name) {
  const std::string link = Cat("/proc/self/fd/", descriptor);
  return ::linkat(AT_FDCWD, link.c_str(), AT_FDCWD, name.c_str(), AT_SYMLINK_FOLLOW) == 0 ? 0 : errno;
}

// rename() without replacing. Falls back to a check and rename() on file systems that lack the flag.
int RenameToNewName(const char* from, const char* to) {
#ifdef RENAME_NOREPLACE
  if (::renameat2(AT_FDCWD, from, AT_FDCWD, to, RENAME_NOREPLACE) == 0) return 0;
  if (errno != EINVAL && errno != ENOSYS) return errno;
#endif
  struct stat info {};
  if (::lstat(to, &info) == 0) return EEXIST;
  return ::rename(from, to) == 0 ? 0 : errno;
}

// Renames over `to` and keeps the previous file as `old`. At any time the name refers to one of the two.
int RenameKeepingOld(const fs::path& from, const fs::path& to, fs::path& old) {
#ifdef RENAME_EXCHANGE
  if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_EXCHANGE) == 0) {
    old = from;
    return 0;
  }
  if (errno != EINVAL && errno != ENOSYS) return errno;
#endif
  fs::path kept;
  do {
    kept = to.parent_path() / TemporaryName();
  } while (::link(to.c_str(), kept.c_str()) != 0 && errno == EEXIST);
  struct stat info {};
  if (::lstat(kept.c_str(), &info) != 0 && ::rename(to.c_str(), kept.c_str()) != 0) return errno;  // no hard links here
  if (::rename(from.c_str(), to.c_str()) == 0) {
    old = kept;
    return 0;
  }
  const int error = errno;
  if (::lstat(to.c_str(), &info) == 0) {
    ::unlink(kept.c_str());
  } else {
    (void)::rename(kept.c_str(), to.c_str());
  }
  return error;
}

// Resolves symbolic links in the last path component, including dangling ones; returns 0 or errno.
int FollowLinks(fs::path& path) {
  constexpr int kMostLinks = 40;  // the system's limit
  for (int links = 0; links < kMostLinks; ++links) {
    std::error_code code;
    const fs::path named = fs::read_symlink(path, code);
    if (code) return code.value() == EINVAL || code.value() == ENOENT ? 0 : code.value();  // not a link, or no file
    path = path.parent_path() / named;
  }
  return ELOOP;
}

}  // namespace

Result<OutputFile> OutputFile::Create(const fs::path& path, bool overwrite, OutputMemory* memory) {
  if (path.empty() || !path.has_filename()) {
    return Error{ErrorCode::kBadArgument, Cat("\"", path.string(), "\" is not the name of a file to write")};
  }
  OutputFile file;
  file.path_ = path;
  file.target_ = path;
  file.overwrite_ = overwrite;
  if (memory != nullptr) {
    file.memory_ = memory;
    file.bytes_ = std::make_unique<MemoryBytes>();
    return file;
  }
  if (path == "-") {
    return Error{ErrorCode::kBadArgument,
                 "-: cannot be written to standard output; pass a file name (./- names a file)"};
  }

  mode_t mode = 0666;  // minus the umask, like any new file
  struct stat info {};
  const bool exists = ::stat(path.c_str(), &info) == 0;
  if (exists) {
    if (S_ISDIR(info.st_mode)) return Error{ErrorCode::kIo, Cat(path.string(), ": is a folder, not a file to write")};
    ANCHORSPLAT_RETURN_IF_ERROR(CheckNotInput(path));
    if (!overwrite && !IsOwnFile(path)) return AlreadyThere(path);
    if (!S_ISREG(info.st_mode)) {
      return Error{ErrorCode::kIo, Cat(path.string(), ": is not a regular file and cannot be replaced by one")};
    }
    mode = info.st_mode & 0777;
  } else if (errno != ENOENT && errno != ENOTDIR) {  // overlong name or link cycle: report before the work
    return WriteError(path, "create a file of this name", errno);
  }
  if (const int error = FollowLinks(file.target_); error != 0 && error != ENOTDIR) {
    return WriteError(path, "follow the symbolic link", error);
  }

  fs::path folder = file.target_.parent_path();
  if (folder.empty()) folder = ".";
  file.descriptor_ = OpenNameless(folder);
  while (file.descriptor_ < 0) {  // skip names left by a killed process with our pid
    file.temporary_ = folder / TemporaryName();
    file.descriptor_ = ::open(file.temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (file.descriptor_ < 0 && errno != EEXIST && errno != EINTR) break;
  }
  if (file.descriptor_ < 0) {
    const int error = errno;
    file.temporary_.clear();
    std::error_code unknown;
    if ((error == ENOENT || error == ENOTDIR) && !fs::is_directory(folder, unknown)) {
      return Error{ErrorCode::kNotFound, Cat(path.string(), ": its folder ", folder.string(), " does not exist")};
    }
    return WriteError(path, "create a file in its folder", error);
  }
  if (exists) (void)::fchmod(file.descriptor_, mode);  // keep the replaced file's permissions, if allowed
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
  memory_ = std::exchange(other.memory_, nullptr);
  bytes_ = std::move(other.bytes_);
  overwrite_ = other.overwrite_;
  written_ = other.written_;
  return *this;
}

OutputFile::~OutputFile() { Discard(); }

void OutputFile::Discard() noexcept {
  if (descriptor_ >= 0) ::close(descriptor_);
  descriptor_ = -1;
  bytes_.reset();
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
  temporary_.clear();
}

Status OutputFile::Reserve(uint64_t bytes) {
  if (bytes_) {
    bytes_->Reserve(bytes);
    return {};
  }
#if defined(FALLOC_FL_KEEP_SIZE) && !defined(__EMSCRIPTEN__)  // it declares the flag but lacks the call
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
  if (bytes_) {
    bytes_->WriteAt(offset, data, size);
    return {};
  }
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

// Finishes writing. A file that may replace another gets a temporary name to be renamed from.
Status OutputFile::FinishBytes() {
  if (memory_ != nullptr) return {};
  const bool replaces = overwrite_ || IsOwnFile(target_);
  if (temporary_.empty() && !replaces) return {};  // stays unnamed until it gets its final name
  while (temporary_.empty()) {
    fs::path name = target_.parent_path() / TemporaryName();
    const int error = NameTheNameless(descriptor_, name);
    if (error == 0) temporary_ = std::move(name);
    // Left by a killed process with our pid, or by one with our pid in another container.
    if (error != 0 && error != EEXIST) return WriteError(path_, "rename the file", error);
  }
  RecordWritten(descriptor_);
  // close() is where network file systems report what they could not write.
  const int closed = ::close(std::exchange(descriptor_, -1));
  if (closed != 0 && errno != EINTR) return WriteError(path_, "write", errno);
  return {};
}

Status OutputFile::TakeName(bool keep_old) {
  if (memory_ != nullptr) {
    memory_->files.insert_or_assign(path_, bytes_->Take());
    return {};
  }
  ANCHORSPLAT_RETURN_IF_ERROR(CheckNotInput(target_));
  int error = 0;
  if (temporary_.empty()) {
    error = NameTheNameless(descriptor_, target_);
    if (error == 0) {
      RecordWritten(descriptor_);
      ::close(std::exchange(descriptor_, -1));  // only local file systems support unnamed files
      return {};
    }
  } else if (struct stat info{}; overwrite_ || IsOwnFile(target_)) {
    const bool there = ::lstat(target_.c_str(), &info) == 0;
    if (there && !S_ISREG(info.st_mode) && !S_ISLNK(info.st_mode)) {
      error = S_ISDIR(info.st_mode) ? EISDIR : EEXIST;
    } else if (there && keep_old) {
      error = RenameKeepingOld(temporary_, target_, old_);
    } else {
      error = ::rename(temporary_.c_str(), target_.c_str()) == 0 ? 0 : errno;
    }
  } else {
    error = RenameToNewName(temporary_.c_str(), target_.c_str());
  }
  if (error == EEXIST) return AlreadyThere(path_);
  if (error != 0) return WriteError(path_, "rename the file", error);
  temporary_.clear();
  return {};
}

Status OutputFile::RestoreOldFile() {
  if (memory_ != nullptr) {
    memory_->files.erase(path_);
    return {};
  }
  if (old_.empty()) return ::unlink(target_.c_str()) == 0 ? Status() : Status(WriteError(path_, "remove", errno));
  const fs::path old = std::exchange(old_, {});
  if (::rename(old.c_str(), target_.c_str()) == 0) return {};
  return WriteError(path_, Cat("restore the previous file, which is kept as ", old.string()).c_str(), errno);
}

Status OutputFile::Commit() { return CommitTogether({this, 1}); }

Status CommitTogether(std::span<OutputFile> files) {
  Status status;
  size_t named = 0;
  for (size_t k = 0; k < files.size() && status.ok(); ++k) status = files[k].FinishBytes();
  if (status.ok()) LeaveIfAbandoned();  // it took a while, and no name is visible yet
  while (named < files.size() && status.ok()) {
    status = files[named].TakeName(/*keep_old=*/files.size() > 1);
    if (status.ok()) ++named;
  }
  if (!status.ok()) {
    for (size_t k = named; k > 0; --k) {
      const Status back = files[k - 1].RestoreOldFile();
      if (!back.ok()) status = Error{status.error().code, Cat(status.error().message, "; ", back.error().message)};
    }
  }
  for (OutputFile& file : files) {
    if (!file.old_.empty()) ::unlink(file.old_.c_str());
    file.old_.clear();
    file.Discard();
  }
  return status;
}

Status CheckWritable(const fs::path& path, bool overwrite) {
  const auto file = OutputFile::Create(path, overwrite);
  return file.ok() ? Status() : Status(file.error());
}

Status WriteOrSaveBeside(const fs::path& path, bool overwrite,
                         const std::function<Status(const fs::path& name, bool overwrite)>& write) {
  const Status status = write(path, overwrite);
  if (status.ok() || (status.error().code != ErrorCode::kExists && status.error().code != ErrorCode::kBadArgument)) {
    return status;
  }
  // "scan-2.ply", also for "scan.compressed.ply". An unpacked SOG is named by its folder, in which all names are fixed.
  const bool folder = path.filename() == "meta.json";
  const fs::path named = folder ? path.parent_path() : path;
  const std::string name = named.filename().string();
  const size_t stem = folder ? name.size() : std::min(name.find('.', 1), name.size());
  constexpr int kMostTries = 1000;
  for (int number = 2; number < kMostTries; ++number) {
    fs::path beside = named.parent_path() / Cat(name.substr(0, stem), "-", number, name.substr(stem));
    if (folder) {
      std::error_code code;
      if (!fs::create_directory(beside, code)) continue;
      beside /= "meta.json";
    }
    const Status kept = write(beside, /*overwrite=*/false);
    if (kept.ok()) {
      return Error{status.error().code, Cat(status.error().message, "; the result is kept as ", beside.string())};
    }
    if (folder) ::rmdir(beside.parent_path().c_str());
    if (kept.error().code != ErrorCode::kExists) break;
  }
  return status;
}

Status WriteWholeFile(const fs::path& path, std::string_view bytes, bool overwrite) {
  ANCHORSPLAT_ASSIGN_OR_RETURN(OutputFile file, OutputFile::Create(path, overwrite));
  ANCHORSPLAT_RETURN_IF_ERROR(file.Write(bytes));
  return file.Commit();
}

}  // namespace anchorsplat
