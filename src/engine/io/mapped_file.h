#pragma once

#include <cstddef>
#include <filesystem>
#include <span>

#include "core/buffer.h"
#include "core/result.h"

namespace anchorsplat {

// The bytes of a file without reading them: pages come from the system's cache when they are first touched, so opening
// costs the same for one kilobyte and for ten gigabytes. Move-only; bytes() stays where it is when the object moves.
//
// Hazard, and our choice: when another process *shortens* the file while it is mapped, touching a page past the new
// end raises SIGBUS and ends the program. We accept that, as every program that maps weights does: the alternatives are
// a copy of the whole file, which is what mapping is there to avoid, or a signal handler for the whole process. Writers
// of this program never change a file in place (they write beside it and rename), which leaves old mappings intact.
// Contents that change under the mapping are harmless to memory safety: all sizes and offsets are read once, when a
// file is opened.
class MappedFile {
 public:
  // Maps a regular file. A file system that cannot map is read into memory instead.
  // Errors: kNotFound; kIo, also for folders, pipes and devices.
  static Result<MappedFile> Open(const std::filesystem::path& path);
  // The same view of bytes that are in memory already.
  static MappedFile FromBytes(Buffer<std::byte> bytes);

  MappedFile(MappedFile&& other) noexcept;
  MappedFile& operator=(MappedFile&& other) noexcept;
  ~MappedFile();

  std::span<const std::byte> bytes() const { return bytes_; }

 private:
  MappedFile() = default;

  std::span<const std::byte> bytes_;
  void* mapping_ = nullptr;  // what munmap gets; null when the bytes are `owned_`
  Buffer<std::byte> owned_;
};

}  // namespace anchorsplat
