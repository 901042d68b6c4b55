#pragma once

#include <string>
#include <vector>

#include "eval/benchmark.h"

namespace anchorsplat {

// Fingerprint of everything an object's results depend on: splat, cameras, low-resolution pictures, and pictures of the
// measured `views` (or the mesh to render them). Files count by size and modification time, so nothing is read. If it
// changes, stored results are invalid.
std::string ObjectState(const BenchmarkObject& object, const std::vector<size_t>& views);

}  // namespace anchorsplat
