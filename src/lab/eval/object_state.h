#pragma once

#include <string>
#include <vector>

#include "eval/benchmark.h"

namespace anchorsplat {

// A word for all that an object's results are made from: the splat, every camera, the low-resolution pictures and those
// of the measured `views` (or the mesh they are rendered from). Files count by size and time of their last change, so
// that nothing has to be read. Another word: results that were kept are not those of this object any more.
std::string ObjectState(const BenchmarkObject& object, const std::vector<size_t>& views);

}  // namespace anchorsplat
