#include "io/mapped_file.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <new>
#include <system_error>
#include <utility>

#include "core/text.h"
#include "io/input_record.h"

namespace anchorsplat {

namespace {

std::string SystemMessage(int code) { return std::generic_category().message(code); }

struct Descriptor {
  int number;
  ~Descriptor() {
    if (number >= 0) close(number);
  }
};

Status ReadWhole(int descriptor, const std::filesystem::path& path, Buffer<std::byte>& out) {
  size_t done = 0;
  while (done < out.size()) {
    const ssize_t got = read(descriptor, out.data() + done, out.size() - done);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return Error{ErrorCode::kIo, Cat(path.string(), ": cannot read: ", SystemMessage(errno))};
    if (got == 0) {
      return Error{ErrorCode::kIo, Cat(path.string(), ": became shorter while it was being read")};
    }
    done += static_cast<size_t>(got);
  }
  return {};
}

}  // namespace

Result<MappedFile> MappedFile::Open(const std::filesystem::path& path) {
  // O_NONBLOCK: opening a pipe without a writer must not block forever; regular files ignore it.
  const Descriptor file{open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)};
  if (file.number < 0) {
    if (errno == ENOENT || errno == ENOTDIR) return Error{ErrorCode::kNotFound, Cat(path.string(), ": no such file")};
    return Error{ErrorCode::kIo, Cat(path.string(), ": cannot open: ", SystemMessage(errno))};
  }
  struct stat info {};
  if (fstat(file.number, &info) != 0) {
    return Error{ErrorCode::kIo, Cat(path.string(), ": cannot read: ", SystemMessage(errno))};
  }
  if (!S_ISREG(info.st_mode)) {
    return Error{
        ErrorCode::kIo,
        Cat(path.string(), S_ISDIR(info.st_mode) ? ": is a folder, expected a file"
                                                 : ": is a pipe or a device, which cannot be mapped; expected a file")};
  }
  RecordInput(file.number, path);
  MappedFile mapped;
  if (info.st_size == 0) return mapped;
  const auto size = static_cast<size_t>(info.st_size);
  void* memory = mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file.number, 0);
  if (memory != MAP_FAILED) {
    madvise(memory, size, MADV_WILLNEED);  // a hint: read ahead instead of page by page
    mapped.mapping_ = memory;
    mapped.bytes_ = {static_cast<const std::byte*>(memory), size};
    return mapped;
  }
  try {
    mapped.owned_.resize(size);
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::kIo, Cat(path.string(), ": does not fit into memory (", HumanBytes(size), ")")};
  }
  ANCHORSPLAT_RETURN_IF_ERROR(ReadWhole(file.number, path, mapped.owned_));
  mapped.bytes_ = mapped.owned_;
  return mapped;
}

MappedFile MappedFile::FromBytes(Buffer<std::byte> bytes) {
  MappedFile file;
  file.owned_ = std::move(bytes);
  file.bytes_ = file.owned_;
  return file;
}

MappedFile::MappedFile(MappedFile&& other) noexcept
    : bytes_(std::exchange(other.bytes_, {})),
      mapping_(std::exchange(other.mapping_, nullptr)),
      owned_(std::move(other.owned_)) {}

MappedFile& MappedFile::operator=(MappedFile&& other) noexcept {
  std::swap(bytes_, other.bytes_);
  std::swap(mapping_, other.mapping_);
  owned_.swap(other.owned_);
  return *this;
}

MappedFile::~MappedFile() {
  if (mapping_ != nullptr) munmap(mapping_, bytes_.size());
}

}  // namespace anchorsplat
