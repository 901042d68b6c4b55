#include "io/input_file.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

#include "core/run_context.h"
#include "core/text.h"
#include "io/input_record.h"
#include "io/size_limit.h"

namespace anchorsplat {

namespace {

constexpr uint64_t kMaxPipe = uint64_t{4} << 30;  // an endless pipe must not take all memory
constexpr size_t kBlock = size_t{256} << 10;      // half of a typical L2 cache
constexpr int kLookMilliseconds = 50;

std::string SystemReason(int error) { return std::generic_category().message(error); }

Error EndsBefore(const std::string& name, uint64_t end) {
  return {ErrorCode::kBadFile,
          Cat(name, ": byte ", WithThousands(static_cast<int64_t>(end)), ": the file ends before its data does")};
}

// Waits for data, the end, or a stop of the run: a pipe may never be written to.
void AwaitPipe(int descriptor) {
  struct pollfd one = {.fd = descriptor, .events = POLLIN, .revents = 0};
  for (;;) {
    const int ready = ::poll(&one, 1, kLookMilliseconds);
    if (ready > 0 || (ready < 0 && errno != EINTR)) return;  // read() reports the error
    LeaveIfAbandoned();
  }
}

Result<Buffer<char>> ReadPipe(int descriptor, const std::string& name) {
  Buffer<char> bytes;
  for (;;) {
    AwaitPipe(descriptor);
    const size_t had = bytes.size();
    bytes.resize(had + kBlock);
    const ssize_t n = ::read(descriptor, bytes.data() + had, kBlock);
    bytes.resize(had + static_cast<size_t>(std::max<ssize_t>(n, 0)));
    if (n == 0) return bytes;
    if (n < 0 && errno != EINTR) return Error{ErrorCode::kIo, Cat(name, ": cannot read: ", SystemReason(errno))};
    if (uint64_t{bytes.size()} > kMaxPipe) {
      return Error{ErrorCode::kIo, Cat(name, ": a pipe with more than ", HumanBytes(kMaxPipe), "; save it to a file")};
    }
  }
}

}  // namespace

Result<InputFile> InputFile::Open(const std::filesystem::path& path) {
  InputFile file;
  file.path_ = path;
  file.name_ = path.string();
  file.has_folder_ = true;
  const std::string& name = file.name_;
  // O_NONBLOCK: opening a pipe without a writer would block forever; reading checks for a stop.
  do {
    file.descriptor_ = path == "-" ? ::fcntl(STDIN_FILENO, F_DUPFD_CLOEXEC, 0)
                                   : ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY | O_NONBLOCK);
  } while (file.descriptor_ < 0 && errno == EINTR);
  if (file.descriptor_ < 0) {
    const int error = errno;
    if (error == ENOENT || error == ENOTDIR) return Error{ErrorCode::kNotFound, Cat(name, ": no such file")};
    return Error{ErrorCode::kIo, Cat(name, ": cannot open: ", SystemReason(error))};
  }
  struct stat info {};
  if (::fstat(file.descriptor_, &info) != 0) {
    return Error{ErrorCode::kIo, Cat(name, ": cannot read: ", SystemReason(errno))};
  }
  if (S_ISDIR(info.st_mode)) return Error{ErrorCode::kIo, Cat(name, ": is a folder, expected a file")};
  if (S_ISFIFO(info.st_mode) || S_ISSOCK(info.st_mode)) {
    if (path != "-") ::fcntl(file.descriptor_, F_SETFL, ::fcntl(file.descriptor_, F_GETFL) & ~O_NONBLOCK);
    const bool is_standard_input = path == "-" || path == "/dev/stdin";
    ANCHORSPLAT_ASSIGN_OR_RETURN(Buffer<char> bytes, ReadPipe(file.descriptor_, name));
    static std::atomic<bool> was_read = false;
    if (is_standard_input && bytes.empty() && was_read) {
      return Error{ErrorCode::kBadArgument,
                   Cat(name, ": standard input is a pipe and was read already: it can be only one input")};
    }
    was_read = was_read || (is_standard_input && !bytes.empty());
    ::close(std::exchange(file.descriptor_, -1));
    file.Own(std::move(bytes));
    return file;
  }
  if (!S_ISREG(info.st_mode)) return Error{ErrorCode::kIo, Cat(name, ": is a device, expected a file")};
  RecordInput(file.descriptor_, path);
  file.size_ = static_cast<uint64_t>(info.st_size);
  return file;
}

template <typename Bytes>
void InputFile::Own(Bytes bytes) {
  const auto kept = std::make_shared<const Bytes>(std::move(bytes));
  memory_ = std::string_view(kept->data(), kept->size());
  size_ = memory_.size();
  owner_ = kept;
}

InputFile InputFile::FromBytes(std::string name, std::string bytes) {
  InputFile file = View(std::move(name), {});
  file.Own(std::move(bytes));
  return file;
}

InputFile InputFile::View(std::string name, std::string_view bytes) {
  InputFile file;
  file.path_ = name;
  file.name_ = std::move(name);
  file.size_ = bytes.size();
  file.memory_ = bytes;
  return file;
}

InputFile InputFile::Inside(const InputFile& outer, std::string name, Buffer<char> bytes) {
  InputFile file;
  file.path_ = outer.path_;
  file.name_ = std::move(name);
  file.has_folder_ = outer.has_folder_;
  file.Own(std::move(bytes));
  return file;
}

Result<InputFile> InputFile::OpenBeside(const std::filesystem::path& name) const {
  if (!has_folder_) {
    return Error{ErrorCode::kBadFile, Cat(this->name(), ": consists of several files (", Printable(name.string()),
                                          " is one of them), which cannot be read from memory or an archive")};
  }
  return Open(path_.parent_path() / name);
}

InputFile::InputFile(InputFile&& other) noexcept { *this = std::move(other); }

InputFile& InputFile::operator=(InputFile&& other) noexcept {
  if (this == &other) return *this;
  if (descriptor_ >= 0) ::close(descriptor_);
  path_ = std::move(other.path_);
  descriptor_ = std::exchange(other.descriptor_, -1);
  name_ = std::move(other.name_);
  has_folder_ = other.has_folder_;
  memory_ = std::exchange(other.memory_, {});
  owner_ = std::move(other.owner_);
  size_ = std::exchange(other.size_, 0);
  kept_ = std::move(other.kept_);
  return *this;
}

InputFile::~InputFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

Status InputFile::ReadAt(uint64_t offset, void* out, size_t size) const {
  if (offset > size_ || size > size_ - offset) return EndsBefore(name(), size_);
  if (descriptor_ < 0) {
    if (size > 0) std::memcpy(out, memory_.data() + offset, size);
    return {};
  }
  char* to = static_cast<char*>(out);
  while (size > 0) {
    const ssize_t n = ::pread(descriptor_, to, size, static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return Error{ErrorCode::kIo, Cat(name(), ": cannot read: ", SystemReason(errno))};
    if (n == 0) return EndsBefore(name(), offset);
    to += n;
    offset += static_cast<uint64_t>(n);
    size -= static_cast<size_t>(n);
  }
  return {};
}

Result<std::string> InputFile::Head(size_t size) const {
  std::string bytes(static_cast<size_t>(std::min<uint64_t>(size, size_)), '\0');
  ANCHORSPLAT_RETURN_IF_ERROR(ReadAt(0, bytes.data(), bytes.size()));
  return bytes;
}

Result<std::string> InputFile::ReadAll(uint64_t max_size) const {
  if (size_ > max_size) {
    return Error{ErrorCode::kBadFile, Cat(name(), ": has ", MoreThanLimit(size_, max_size), " for such a file")};
  }
  return Head(static_cast<size_t>(size_));
}

Result<std::string_view> InputFile::Contents(uint64_t max_size) const {
  if (descriptor_ < 0 && size_ <= max_size) return memory_;
  const std::lock_guard lock(kept_->mutex);
  if (!kept_->bytes) {
    ANCHORSPLAT_ASSIGN_OR_RETURN(kept_->bytes, ReadAll(max_size));
  }
  return std::string_view(*kept_->bytes);
}

SequentialReader::SequentialReader(const InputFile& file, uint64_t offset)
    : file_(&file), block_(new char[kBlock]), block_begin_(offset) {}

Status SequentialReader::Fill(size_t at_least) {
  const size_t left = block_size_ - at_;
  std::memmove(block_.get(), block_.get() + at_, left);
  block_begin_ += at_;
  block_size_ = left;
  at_ = 0;
  const uint64_t end = block_begin_ + left;
  const uint64_t available = end < file_->size() ? file_->size() - end : 0;
  const size_t wanted = static_cast<size_t>(std::min<uint64_t>(available, kBlock - left));
  ANCHORSPLAT_RETURN_IF_ERROR(file_->ReadAt(end, block_.get() + left, wanted));
  block_size_ += wanted;
  if (block_size_ < at_least) return EndsBefore(file_->name(), file_->size());
  return {};
}

Result<const char*> SequentialReader::View(size_t size) {
  if (block_size_ - at_ < size) ANCHORSPLAT_RETURN_IF_ERROR(Fill(size));
  const char* bytes = block_.get() + at_;
  at_ += size;
  return bytes;
}

Status SequentialReader::Skip(uint64_t size) {
  if (size <= block_size_ - at_) {
    at_ += static_cast<size_t>(size);
    return {};
  }
  const uint64_t from = position();
  if (from > file_->size() || size > file_->size() - from) return EndsBefore(file_->name(), file_->size());
  block_begin_ = from + size;
  block_size_ = at_ = 0;
  return {};
}

Result<std::string_view> SequentialReader::Peek() {
  if (at_ == block_size_) ANCHORSPLAT_RETURN_IF_ERROR(Fill(0));
  return std::string_view(block_.get() + at_, block_size_ - at_);
}

}  // namespace anchorsplat
