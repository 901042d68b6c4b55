#include "core/companion.h"

#include <system_error>

namespace anchorsplat {

namespace fs = std::filesystem;

fs::path ProgramFolder() {
  std::error_code ignored;
  return fs::read_symlink("/proc/self/exe", ignored).parent_path();
}

fs::path CompanionFile(const std::string& name, const fs::path& program_folder) {
  std::error_code ignored;
  const fs::path beside = program_folder / name;
  if (fs::exists(beside, ignored)) return beside;
  const fs::path installed = program_folder.parent_path() / "lib" / "anchorsplat" / name;
  return fs::exists(installed, ignored) ? installed : beside;
}

}  // namespace anchorsplat
