#pragma once

#include <filesystem>
#include <string>

namespace anchorsplat {

// Folder of the running executable, with links resolved.
std::filesystem::path ProgramFolder();

// Path of a file built or installed with this program (the LPIPS plugin, the training program): beside the executable,
// as in a build folder, or in ../lib/anchorsplat, where `make install` puts it. The former if neither exists.
std::filesystem::path CompanionFile(const std::string& name,
                                    const std::filesystem::path& program_folder = ProgramFolder());

}  // namespace anchorsplat
