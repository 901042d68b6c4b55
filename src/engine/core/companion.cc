#include "core/companion.h"

#include <system_error>

#include "core/file_system.h"

namespace anchorsplat {

namespace fs = std::filesystem;

fs::path ProgramFolder() {
  std::error_code ignored;
  return fs::read_symlink("/proc/self/exe", ignored).parent_path();
}

fs::path CompanionFile(const std::string& name, const fs::path& program_folder) {
  const fs::path beside = program_folder / name;
  if (Exists(beside)) return beside;
  const fs::path installed = program_folder.parent_path() / "lib" / "anchorsplat" / name;
  return Exists(installed) ? installed : beside;
}

}  // namespace anchorsplat
