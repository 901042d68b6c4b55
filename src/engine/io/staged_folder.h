#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/result.h"
#include "io/file_lock.h"

namespace anchorsplat {

// Folders that a file names, as the chunks of a scene and of a page: they are filled under a hidden name beside that
// file, get their names together once all are whole, and then the file gets its own. Until then nothing under its name
// has changed, however the process ends. What a killed run leaves is a hidden folder, which the next one for the same
// file clears away.
//
//   ANCHORSPLAT_ASSIGN_OR_RETURN(OutputFile index, OutputFile::Create(path, overwrite));
//   ANCHORSPLAT_ASSIGN_OR_RETURN(StagedFolder staged, StagedFolder::Create(path));
//   … write staged.path() / "0_0" / …
//   ANCHORSPLAT_RETURN_IF_ERROR(staged.Publish({"0_0", "0_1"}));
//   ANCHORSPLAT_RETURN_IF_ERROR(index.Commit());
//   staged.Keep();
class StagedFolder {
 public:
  // Beside `file`, whose folder is there. Errors: kExists when another process is writing the same file; kIo.
  static Result<StagedFolder> Create(const std::filesystem::path& file);
  StagedFolder(StagedFolder&& other) noexcept;
  StagedFolder& operator=(StagedFolder&&) = delete;
  // Takes away what has no name yet and, unless they are kept, those that have.
  ~StagedFolder();

  const std::filesystem::path& path() const { return path_; }
  // Gives the folders `from` in it the names `to` beside the file: all or none. Nothing that is there is replaced: an
  // error (kIo), as is whatever else the system has against it.
  Status Publish(std::span<const std::string> from, std::span<const std::string> to);
  // They stay: the file that names them is there.
  void Keep() { published_.clear(); }

 private:
  explicit StagedFolder(FileLock lock) : lock_(std::move(lock)) {}

  std::filesystem::path path_;
  std::vector<std::filesystem::path> published_;
  FileLock lock_;
};

}  // namespace anchorsplat
