#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "core/buffer.h"
#include "core/result.h"

namespace anchorsplat {

// A file opened for reading: a byte range of known size that any thread may read anywhere. Regular files are read with
// pread, not mapped: a mapped file that someone truncates while we read kills the process (SIGBUS), and copying from
// the page cache into a buffer that stays in the processor's cache is as fast. Pipes (`… | anchorsplat /dev/stdin`)
// are taken into memory first. "-" is standard input.
class InputFile {
 public:
  // Errors: kNotFound; kIo for folders, devices, files we may not read and pipes with more than 4 GiB.
  static Result<InputFile> Open(const std::filesystem::path& path);
  // Bytes in memory that read like a file; `name` is what messages call it.
  static InputFile FromBytes(std::string name, std::string bytes);
  // The same of bytes that stay where they are as long as the file.
  static InputFile View(std::string name, std::string_view bytes);
  // What `outer` holds, taken out of it: messages call it `name`, and what lies beside `outer` lies beside it.
  static InputFile Inside(const InputFile& outer, std::string name, Buffer<char> bytes);

  InputFile(InputFile&& other) noexcept;
  InputFile& operator=(InputFile&& other) noexcept;
  ~InputFile();

  // A file that belongs to this one, by its name relative to this one's folder. Errors: those of Open; kBadFile where
  // this one is bytes in memory, beside which there are no files.
  Result<InputFile> OpenBeside(const std::filesystem::path& name) const;

  bool has_folder() const { return has_folder_; }  // whether there are files beside it
  const std::filesystem::path& path() const { return path_; }
  std::string name() const { return name_; }  // for messages
  uint64_t size() const { return size_; }     // bytes, when it was opened

  // Exactly `size` bytes from `offset`. kBadFile when the file ends before (it may have been cut since it was opened).
  Status ReadAt(uint64_t offset, void* out, size_t size) const;
  // The first `size` bytes, or all there are.
  Result<std::string> Head(size_t size) const;
  // The whole file; kBadFile when it is larger than `max_size`.
  Result<std::string> ReadAll(uint64_t max_size) const;
  // The same without a copy for each caller: read at the first call and kept as long as the file, so that what needs
  // all of it in several places reads it once. The view is valid until the file is moved or gone.
  Result<std::string_view> Whole(uint64_t max_size) const;

 private:
  InputFile() = default;
  template <typename Bytes>
  void Own(Bytes bytes);

  std::filesystem::path path_;
  std::string name_;
  int descriptor_ = -1;      // −1: the bytes are in memory
  bool has_folder_ = false;  // it was opened by its path
  std::string_view memory_;
  std::shared_ptr<const void> owner_;  // of them; null: somebody else
  uint64_t size_ = 0;
  struct Kept {
    std::mutex mutex;
    std::optional<std::string> bytes;
  };
  std::unique_ptr<Kept> kept_ = std::make_unique<Kept>();
};

// Forward reading with a block buffer, for the parts of files whose layout is only known while reading.
class SequentialReader {
 public:
  SequentialReader(const InputFile& file, uint64_t offset);

  uint64_t position() const { return block_begin_ + at_; }  // byte in the file
  // The next `size` bytes (≤ kMaxView), valid until the next call; an error like InputFile::ReadAt at the file's end.
  Result<const char*> View(size_t size);
  // Passes over bytes without reading them; kBadFile when the file has fewer.
  Status Skip(uint64_t size);
  // What is left in the block, at least one byte unless the file has ended; Consume() passes over part of it.
  Result<std::string_view> Peek();
  void Consume(size_t size) { at_ += size; }

  static constexpr size_t kMaxView = 4096;

 private:
  Status Fill(size_t at_least);

  const InputFile* file_;
  std::unique_ptr<char[]> block_;
  uint64_t block_begin_;   // byte in the file where the block begins
  size_t block_size_ = 0;  // bytes in the block
  size_t at_ = 0;          // next byte in the block
};

}  // namespace anchorsplat
