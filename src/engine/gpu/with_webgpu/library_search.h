#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace anchorsplat {

// Places to search for a WebGPU library; empty ones are skipped.
struct LibrarySearch {
  std::string named = {};                               // ANCHORSPLAT_WEBGPU
  std::filesystem::path module_folder = {};             // SetGpuLibraryHint
  std::filesystem::path program_folder = {};            // of the executable
  std::filesystem::path virtual_environment = {};       // VIRTUAL_ENV
  std::filesystem::path conda_environment = {};         // CONDA_PREFIX
  std::filesystem::path pyenv = {};                     // PYENV_ROOT; its programs on PATH are scripts
  std::vector<std::filesystem::path> executables = {};  // folders of PATH
  std::filesystem::path home = {};
};
LibrarySearch LibrarySearchOfProcess(const std::filesystem::path& module_folder);

// Candidate files, best first. A named one excludes all others. Else: beside the module or the program, in its
// ../lib/anchorsplat, in webgpu/ of its build folder; then in the Python package wgpu beside the module, beside this
// program's package, or of a Python on PATH or in an environment. All exist, except a named one and the last, a bare
// name for the system's loader.
std::vector<std::string> LibraryCandidates(const LibrarySearch& search);

}  // namespace anchorsplat
