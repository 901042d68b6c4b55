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

// A file opened for reading: a byte range of known size with thread-safe random access. Uses pread, not mmap:
// truncation of a mapped file would kill the process (SIGBUS), and copying from the page cache into a cached buffer is
// as fast. Pipes (`… | anchorsplat /dev/stdin`) are read into memory first. "-" is standard input.
class InputFile {
 public:
  // Errors: kNotFound; kIo: folders, devices, unreadable files, pipes with more than 4 GiB.
  static Result<InputFile> Open(const std::filesystem::path& path);
  // A file in memory. `name` is used in messages.
  static InputFile FromBytes(std::string name, std::string bytes);
  // The same with borrowed bytes, which must outlive the file.
  static InputFile View(std::string name, std::string_view bytes);
  // Decompressed contents of `outer`. `name` is used in messages; OpenBeside works as for `outer`.
  static InputFile Inside(const InputFile& outer, std::string name, Buffer<char> bytes);

  InputFile(InputFile&& other) noexcept;
  InputFile& operator=(InputFile&& other) noexcept;
  ~InputFile();

  // Opens a file by its name relative to this file's folder. Errors: those of Open; kBadFile: this file is in memory
  // and has no folder.
  Result<InputFile> OpenBeside(const std::filesystem::path& name) const;

  bool has_folder() const { return has_folder_; }  // whether OpenBeside can work
  const std::filesystem::path& path() const { return path_; }
  std::string name() const { return name_; }  // for messages
  uint64_t size() const { return size_; }     // bytes, when opened

  // Reads exactly `size` bytes at `offset`. kBadFile: the file ends before (it may have been truncated since it was
  // opened).
  Status ReadAt(uint64_t offset, void* out, size_t size) const;
  // The first `size` bytes, or fewer if the file is shorter.
  Result<std::string> Head(size_t size) const;
  // The whole file; kBadFile: larger than `max_size`.
  Result<std::string> ReadAll(uint64_t max_size) const;
  // The same, but read once and kept as long as this object. The view is valid until the object is moved or destroyed.
  Result<std::string_view> Contents(uint64_t max_size) const;

 private:
  InputFile() = default;
  template <typename Bytes>
  void Own(Bytes bytes);

  std::filesystem::path path_;
  std::string name_;
  int descriptor_ = -1;      // −1: in memory
  bool has_folder_ = false;  // opened by path
  std::string_view memory_;
  std::shared_ptr<const void> owner_;  // of memory_; null: borrowed
  uint64_t size_ = 0;
  struct Kept {
    std::mutex mutex;
    std::optional<std::string> bytes;
  };
  std::unique_ptr<Kept> kept_ = std::make_unique<Kept>();
};

// Buffered sequential reading, for formats whose layout is only known while reading.
class SequentialReader {
 public:
  SequentialReader(const InputFile& file, uint64_t offset);

  uint64_t position() const { return block_begin_ + at_; }  // byte offset in the file
  // The next `size` bytes (≤ kMaxView), valid until the next call. Error at the end of the file: as InputFile::ReadAt.
  Result<const char*> View(size_t size);
  // Skips bytes without reading them; kBadFile if the file has fewer.
  Status Skip(uint64_t size);
  // The rest of the block, at least one byte unless the file has ended. Consume() skips part of it.
  Result<std::string_view> Peek();
  void Consume(size_t size) { at_ += size; }

  static constexpr size_t kMaxView = 4096;

 private:
  Status Fill(size_t at_least);

  const InputFile* file_;
  std::unique_ptr<char[]> block_;
  uint64_t block_begin_;   // offset of the block in the file
  size_t block_size_ = 0;  // bytes in the block
  size_t at_ = 0;          // next byte in the block
};

}  // namespace anchorsplat
