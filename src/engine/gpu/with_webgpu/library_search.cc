#include "gpu/with_webgpu/library_search.h"

#include <algorithm>
#include <cstdlib>
#include <sstream>
#include <system_error>
#include <utility>

#include "core/companion.h"
#include "core/file_system.h"

namespace anchorsplat {

namespace fs = std::filesystem;

namespace {

// Names in the wheel and as a system library.
constexpr const char* kLibraryNames[] = {"libwgpu_native-release.so", "libwgpu_native.so"};
constexpr const char* kSystemLibrary = "libwgpu_native.so";

std::string Environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

class Candidates {
 public:
  void AddFolder(const fs::path& folder) {
    for (const char* name : kLibraryNames) {
      const fs::path file = folder / name;
      if (!IsFile(file)) continue;
      if (std::find(found_.begin(), found_.end(), file.string()) == found_.end()) found_.push_back(file.string());
    }
  }

  void AddAround(const fs::path& folder) {
    if (folder.empty()) return;
    AddFolder(folder);
    AddFolder(folder.parent_path() / "lib" / "anchorsplat");
    for (fs::path at = folder; at.has_relative_path(); at = at.parent_path()) {
      if (at.filename() == "build") AddFolder(at / "webgpu");
    }
  }

  // Package folders of the Python with this prefix.
  void AddPrefix(const fs::path& prefix) {
    if (prefix.empty()) return;
    for (const fs::path& library : EntriesOf(prefix / "lib")) {
      if (!library.filename().string().starts_with("python3")) continue;
      for (const char* packages : {"site-packages", "dist-packages"}) {
        AddFolder(library / packages / "wgpu" / "resources");
      }
    }
  }

  void AddPrefixesIn(const fs::path& folder) {
    for (const fs::path& prefix : EntriesOf(folder)) AddPrefix(prefix);
  }

  std::vector<std::string> Take() { return std::move(found_); }

 private:
  // Sorted entries; none if the folder cannot be read.
  static std::vector<fs::path> EntriesOf(const fs::path& folder) {
    std::vector<fs::path> entries;
    std::error_code failed;
    for (fs::directory_iterator entry(folder, failed), end; !failed && entry != end; entry.increment(failed)) {
      entries.push_back(entry->path());
    }
    std::sort(entries.begin(), entries.end());
    return entries;
  }

  std::vector<std::string> found_;
};

}  // namespace

LibrarySearch LibrarySearchOfProcess(const fs::path& module_folder) {
  LibrarySearch search{.named = Environment("ANCHORSPLAT_WEBGPU"),
                       .module_folder = module_folder,
                       .program_folder = ProgramFolder(),
                       .virtual_environment = Environment("VIRTUAL_ENV"),
                       .conda_environment = Environment("CONDA_PREFIX"),
                       .pyenv = Environment("PYENV_ROOT"),
                       .executables = {},
                       .home = Environment("HOME")};
  if (search.pyenv.empty() && !search.home.empty()) search.pyenv = search.home / ".pyenv";
  std::istringstream path(Environment("PATH"));
  for (std::string folder; std::getline(path, folder, ':');) {
    if (!folder.empty()) search.executables.emplace_back(folder);
  }
  return search;
}

std::vector<std::string> LibraryCandidates(const LibrarySearch& search) {
  if (!search.named.empty()) return {search.named};
  Candidates candidates;
  candidates.AddAround(search.module_folder);
  if (!search.module_folder.empty()) candidates.AddFolder(search.module_folder.parent_path() / "wgpu" / "resources");
  candidates.AddAround(search.program_folder);
  if (search.program_folder.filename() == "_bin") {  // in the Python package
    candidates.AddFolder(search.program_folder.parent_path().parent_path() / "wgpu" / "resources");
  }
  candidates.AddPrefix(search.virtual_environment);
  candidates.AddPrefix(search.conda_environment);
  for (const fs::path& folder : search.executables) {
    if (Exists(folder / "python3") || Exists(folder / "python")) candidates.AddPrefix(folder.parent_path());
  }
  if (!search.pyenv.empty()) candidates.AddPrefixesIn(search.pyenv / "versions");
  if (!search.home.empty()) candidates.AddPrefix(search.home / ".local");
  std::vector<std::string> found = candidates.Take();
  found.emplace_back(kSystemLibrary);
  return found;
}

}  // namespace anchorsplat
