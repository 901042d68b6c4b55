#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/result.h"
#include "io/file_lock.h"

namespace anchorsplat {

// Publishes folders that a file refers to, such as the chunks of a scene or a page. They are filled under a hidden name
// beside the file, get their names together when complete, and then the file gets its own. Until then nothing visible
// has changed, however the process ends. A killed run leaves a hidden folder, which the next run for the same file
// removes.
//
//   ANCHORSPLAT_ASSIGN_OR_RETURN(OutputFile index, OutputFile::Create(path, overwrite));
//   ANCHORSPLAT_ASSIGN_OR_RETURN(StagedFolder staged, StagedFolder::Create(path));
//   … write staged.path() / "0_0" / …
//   ANCHORSPLAT_RETURN_IF_ERROR(staged.Publish({"0_0", "0_1"}));
//   ANCHORSPLAT_RETURN_IF_ERROR(index.Commit());
//   staged.Keep();
class StagedFolder {
 public:
  // Stages beside `file`, whose folder must exist. Errors: kExists: another process is writing the same file; kIo.
  static Result<StagedFolder> Create(const std::filesystem::path& file);
  StagedFolder(StagedFolder&& other) noexcept;
  StagedFolder& operator=(StagedFolder&&) = delete;
  // Removes unpublished folders, and published ones unless Keep() was called.
  ~StagedFolder();

  const std::filesystem::path& path() const { return path_; }
  // Renames the staged folders `from` to `to` beside the file: all or none. Never replaces anything. Errors: kIo.
  Status Publish(std::span<const std::string> from, std::span<const std::string> to);
  // Makes published folders permanent, once the file that refers to them exists.
  void Keep() { published_.clear(); }

 private:
  explicit StagedFolder(FileLock lock) : lock_(std::move(lock)) {}

  std::filesystem::path path_;
  std::vector<std::filesystem::path> published_;
  FileLock lock_;
};

}  // namespace anchorsplat
