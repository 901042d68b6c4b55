#include "io/staged_folder.h"

#include <cstddef>
#include <system_error>
#include <utility>

#include "core/file_system.h"
#include "core/text.h"

namespace anchorsplat {

namespace fs = std::filesystem;

Result<StagedFolder> StagedFolder::Create(const fs::path& file) {
  const fs::path folder = file.parent_path();
  const std::string name = ".anchorsplat-" + file.filename().string();
  ANCHORSPLAT_ASSIGN_OR_RETURN(FileLock lock, FileLock::TakeAndRemove(folder / (name + ".lock")));
  StagedFolder staged(std::move(lock));
  const fs::path path = folder / (name + ".partial");
  std::error_code failed;
  fs::remove_all(path, failed);  // left by a killed run
  if (!failed) fs::create_directory(path, failed);
  if (failed) return Error{ErrorCode::kIo, Cat(path.string(), ": cannot create this folder: ", failed.message())};
  staged.path_ = path;
  return staged;
}

StagedFolder::StagedFolder(StagedFolder&& other) noexcept
    : path_(std::move(other.path_)), published_(std::move(other.published_)), lock_(std::move(other.lock_)) {
  other.path_.clear();
  other.published_.clear();
}

StagedFolder::~StagedFolder() {
  std::error_code ignored;
  for (const fs::path& folder : published_) fs::remove_all(folder, ignored);
  if (!path_.empty()) fs::remove_all(path_, ignored);
}

Status StagedFolder::Publish(std::span<const std::string> from, std::span<const std::string> to) {
  for (size_t k = 0; k < from.size(); ++k) {
    const fs::path target = path_.parent_path() / to[k];
    std::error_code failed;
    // A rename would replace an empty folder.
    if (fs::symlink_status(target, failed).type() != fs::file_type::not_found) {
      return Error{ErrorCode::kIo, Cat(target.string(), ": was created by another program meanwhile")};
    }
    fs::rename(path_ / from[k], target, failed);
    if (failed) return Error{ErrorCode::kIo, Cat(target.string(), ": cannot be renamed: ", failed.message())};
    published_.push_back(target);
  }
  return {};
}

}  // namespace anchorsplat
