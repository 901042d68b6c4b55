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

// An output file that appears under its name complete or not at all. Bytes go to an unnamed file (O_TMPFILE) in the
// same folder; Commit() names it. Without Commit() nothing is left, however the process ends. On systems without
// O_TMPFILE a hidden ".anchorsplat-*.partial" is used instead, which only a kill leaves behind. Nothing is fsynced:
// this protects against crashes of the program, not of the machine.
//
// A symbolic link stays, and its target is written. Files that the command has read are never replaced; its own state
// may always be (input_record.h).
//
//   ANCHORSPLAT_ASSIGN_OR_RETURN(OutputFile file, OutputFile::Create(path, options.overwrite));
//   ANCHORSPLAT_RETURN_IF_ERROR(file.Write(bytes));
//   return file.Commit();
class OutputFile {
 public:
  // Errors: kBadArgument: `path` is an input. kExists: it exists and `overwrite` is false. kNotFound: its folder does
  // not exist. kIo: a system error, or `path` cannot be replaced by a file.
  // With `memory`, the file is stored there under the name `path` and the file system is not touched; only an empty
  // name is an error. Running out of memory throws std::bad_alloc.
  static Result<OutputFile> Create(const std::filesystem::path& path, bool overwrite, OutputMemory* memory = nullptr);

  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&& other) noexcept;
  ~OutputFile();

  const std::filesystem::path& path() const { return path_; }

  // Reserves disk space, so that a full disk fails now and not at the last byte. The final size is still what is
  // written. Not an error on file systems that cannot reserve.
  Status Reserve(uint64_t bytes);
  // Appends after previous Write() calls.
  Status Write(const void* data, size_t size);
  Status Write(std::string_view bytes) { return Write(bytes.data(), bytes.size()); }
  // Writes at a byte offset. Thread-safe for disjoint ranges.
  Status WriteAt(uint64_t offset, const void* data, size_t size) const;

  // Gives the file its name. Errors: kExists: a file appeared there since Create() and `overwrite` is false.
  // kBadArgument: the command has read that file since.
  Status Commit();

 private:
  friend Status CommitTogether(std::span<OutputFile> files);

  OutputFile() = default;
  void Discard() noexcept;
  Status FinishBytes();
  Status TakeName(bool keep_old);
  Status RestoreOldFile();

  std::filesystem::path path_;    // as given by the caller, for messages
  std::filesystem::path target_;  // file to replace: `path_` with symbolic links followed
  std::filesystem::path temporary_;
  std::filesystem::path old_;  // backup of the replaced file until all of CommitTogether succeed
  int descriptor_ = -1;
  OutputMemory* memory_ = nullptr;  // destination instead of a file, or null
  std::unique_ptr<MemoryBytes> bytes_;
  bool overwrite_ = false;
  uint64_t written_ = 0;
};

// Checks by trying whether a file can be created at `path`, before hours of work. Errors: those of OutputFile::Create.
Status CheckWritable(const std::filesystem::path& path, bool overwrite = true);

// Calls `write` with `path`. If the name has been taken since CheckWritable (kExists, kBadArgument), calls it again
// with the next free name beside it, "scan-2.ply", and returns an error that names that file.
Status WriteOrSaveBeside(const std::filesystem::path& path, bool overwrite,
                         const std::function<Status(const std::filesystem::path& name, bool overwrite)>& write);

// Commits related files in order; the last one should be the one that refers to the others. All or none: on failure,
// the files replaced so far are restored.
Status CommitTogether(std::span<OutputFile> files);

// Writes `bytes` as a file: Create, Write, Commit.
Status WriteWholeFile(const std::filesystem::path& path, std::string_view bytes, bool overwrite);

}  // namespace anchorsplat
