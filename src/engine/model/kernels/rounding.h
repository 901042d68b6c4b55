#pragma once

#include <cstdint>

namespace anchorsplat {

// Which precision the values of a step are rounded to; the sums stay in fp32.
enum class Rounding : uint8_t { kNone, kHalf, kBFloat16 };

}  // namespace anchorsplat
