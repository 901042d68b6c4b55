#pragma once

#include <filesystem>

namespace anchorsplat {

// The checkout that a test was built from: where `testdata/`, `examples/` and `configs/` are. Defined in one generated
// file (cmake/Room.cmake) and not by a macro, so that a test compiles to the same object wherever the checkout lies.
std::filesystem::path SourceDirForTest();

}  // namespace anchorsplat
