#pragma once

#include <cstdint>

namespace anchorsplat {

// Precision to which a step's values are rounded; sums stay in fp32.
enum class Rounding : uint8_t { kNone, kHalf, kBFloat16 };

}  // namespace anchorsplat
