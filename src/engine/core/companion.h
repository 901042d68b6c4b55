#pragma once

#include <filesystem>
#include <string>

namespace anchorsplat {

// The folder of the running program itself, wherever links to it lie.
std::filesystem::path ProgramFolder();

// A file that this program uses at run time and that was built or installed with it (the LPIPS plugin, the training):
// beside the program, as in a build folder, or in ../lib/anchorsplat, where `make install` puts what nobody calls by
// name. The former where there is neither.
std::filesystem::path CompanionFile(const std::string& name,
                                    const std::filesystem::path& program_folder = ProgramFolder());

}  // namespace anchorsplat
