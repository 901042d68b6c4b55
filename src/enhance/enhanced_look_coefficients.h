#pragma once

#include <array>
#include <cstddef>

#include "enhance/enhanced_look.h"

namespace anchorsplat {

inline constexpr size_t kEnhancedLookHidden = 16;

// Written by scripts/train-enhanced-look.py. x = (feature − middle) / width, at most 4 either way;
// ln odds = last + Σ outer · tanh(bias + Σ inner · x).
struct EnhancedLookNetwork {
  EnhancedLook middle, width;
  std::array<EnhancedLook, kEnhancedLookHidden> inner;
  std::array<double, kEnhancedLookHidden> bias, outer;
  double last;
};
extern const EnhancedLookNetwork kEnhancedLookNetwork;

}  // namespace anchorsplat
