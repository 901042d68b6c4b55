#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace anchorsplat {

// Where a library that speaks WebGPU may lie. What is empty is not looked at.
struct LibrarySearch {
  std::string named = {};                               // ANCHORSPLAT_WEBGPU
  std::filesystem::path module_folder = {};             // SetGpuLibraryHint
  std::filesystem::path program_folder = {};            // of the running program
  std::filesystem::path virtual_environment = {};       // VIRTUAL_ENV
  std::filesystem::path conda_environment = {};         // CONDA_PREFIX
  std::filesystem::path pyenv = {};                     // PYENV_ROOT, whose programs on PATH are scripts
  std::vector<std::filesystem::path> executables = {};  // the folders of PATH
  std::filesystem::path home = {};
};
LibrarySearch LibrarySearchOfProcess(const std::filesystem::path& module_folder);

// Files to try, best first: the named one and no other; beside the module or the program, in ../lib/anchorsplat of it,
// in webgpu/ of the build folder that it lies in; in the package wgpu beside the module, beside the package of the
// program or of a Python on PATH or of an environment. All of them exist, except for a named one and for the last, a
// name that the system's loader looks for by itself.
std::vector<std::string> LibraryCandidates(const LibrarySearch& search);

}  // namespace anchorsplat
