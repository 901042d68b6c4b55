#pragma once

#include <cstddef>
#include <filesystem>
#include <span>

#include "core/buffer.h"
#include "core/result.h"

namespace anchorsplat {

// A memory-mapped file: opening costs the same for any size, and pages are loaded when touched. Move-only; bytes()
// stays valid when the object moves.
//
// Hazard: if another process *shortens* the file while it is mapped, touching a page past the new end ends the program
// (SIGBUS). We accept that, as other programs that map weights do: the alternatives are a copy of the file or a
// process-wide signal handler. This program never changes files in place (it writes beside and renames), so its own
// writers leave mappings intact. Contents that change under the mapping cannot break memory safety: sizes and offsets
// are read once, on opening.
class MappedFile {
 public:
  // Maps a regular file, or reads it into memory if the file system cannot map. Errors: kNotFound; kIo: also for
  // folders, pipes and devices.
  static Result<MappedFile> Open(const std::filesystem::path& path);
  // A MappedFile of bytes in memory.
  static MappedFile FromBytes(Buffer<std::byte> bytes);

  MappedFile(MappedFile&& other) noexcept;
  MappedFile& operator=(MappedFile&& other) noexcept;
  ~MappedFile();

  std::span<const std::byte> bytes() const { return bytes_; }

 private:
  MappedFile() = default;

  std::span<const std::byte> bytes_;
  void* mapping_ = nullptr;  // for munmap; null if the bytes are in owned_
  Buffer<std::byte> owned_;
};

}  // namespace anchorsplat
