#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string_view>

#include "core/result.h"
#include "io/output_memory.h"

namespace anchorsplat {

// A file that appears under its name whole or not at all: bytes go to a file without a name in the same folder,
// Commit() names it. Without Commit() nothing is left, however the process ends. Where the system has no nameless files
// (O_TMPFILE), a hidden ".anchorsplat-*.partial" stands in, which only a kill leaves behind. Nothing is fsynced: this
// protects against crashes of the program, not of the machine, and costs no disk flush.
//
// Through a symbolic link the file that it names is written; the link stays. Nothing that the command has read is ever
// replaced, and its own state always is (input_record.h).
//
//   ANCHORSPLAT_ASSIGN_OR_RETURN(OutputFile file, OutputFile::Create(path, options.overwrite));
//   ANCHORSPLAT_RETURN_IF_ERROR(file.Write(bytes));
//   return file.Commit();
class OutputFile {
 public:
  // Errors: kBadArgument when `path` is an input; kExists when it exists and `overwrite` is false; kNotFound when its
  // folder does not; kIo when the system refuses or `path` is something that cannot be replaced by a file.
  // With `memory` the file goes there under the name `path` and nothing of the file system is looked at: then only an
  // empty name is an error. Running out of memory throws std::bad_alloc.
  static Result<OutputFile> Create(const std::filesystem::path& path, bool overwrite, OutputMemory* memory = nullptr);

  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&& other) noexcept;
  ~OutputFile();

  const std::filesystem::path& path() const { return path_; }

  // Claims disk space, so that a full disk is an error now and not at the last byte. The final size is still decided by
  // what is written; file systems that cannot reserve are no error.
  Status Reserve(uint64_t bytes);
  // Appends to what Write() wrote before.
  Status Write(const void* data, size_t size);
  Status Write(std::string_view bytes) { return Write(bytes.data(), bytes.size()); }
  // Writes at a byte offset of its own; may be called from several threads for disjoint ranges.
  Status WriteAt(uint64_t offset, const void* data, size_t size) const;

  // Gives the file its name. A file that came into being under that name since Create() is kExists unless `overwrite`,
  // one that was read since then is kBadArgument.
  Status Commit();

 private:
  friend Status CommitTogether(std::span<OutputFile> files);

  OutputFile() = default;
  void Discard() noexcept;
  Status FinishBytes();
  Status TakeName(bool keep_old);
  Status GiveNameBack();

  std::filesystem::path path_;    // as the caller said it: for messages
  std::filesystem::path target_;  // what is renamed over: `path_` with a symbolic link followed
  std::filesystem::path temporary_;
  std::filesystem::path old_;  // where the file that had the name is kept until the others have theirs
  int descriptor_ = -1;
  OutputMemory* memory_ = nullptr;  // where it goes instead
  std::unique_ptr<MemoryBytes> bytes_;
  bool overwrite_ = false;
  uint64_t written_ = 0;
};

// Whether a file can come into being under that name, by trying: for knowing it before hours of work. Errors: those of
// OutputFile::Create.
Status CheckWritable(const std::filesystem::path& path, bool overwrite = true);

// `write` under this name. Where that is refused for the file that has the name now (kExists, kBadArgument), which
// CheckWritable did not see before the work, the result is written under the next free name beside it, "scan-2.ply";
// the error names it.
Status WriteOrKeep(const std::filesystem::path& path, bool overwrite,
                   const std::function<Status(const std::filesystem::path& name, bool overwrite)>& write);

// Commits files that belong together, in their order: the last one is the one that names the others. All or none: where
// one of them cannot have its name, those before it give theirs back to the files that had them.
Status CommitTogether(std::span<OutputFile> files);

// The whole of `bytes` as a file: Create, Write, Commit.
Status WriteWholeFile(const std::filesystem::path& path, std::string_view bytes, bool overwrite);

}  // namespace anchorsplat
