#pragma once

#include <filesystem>

namespace anchorsplat {

// The checkout that a test was built from, with `testdata/`, `examples/` and `configs/`. Defined in one generated file
// (cmake/Room.cmake) instead of a macro, so that object files do not depend on the checkout's path.
std::filesystem::path SourceDirForTest();

}  // namespace anchorsplat
