#pragma once

#include "enhance/enhanced_look.h"

namespace anchorsplat {

// Written by scripts/train-enhanced-look.py. ln odds = intercept + Σ weight · feature.
extern const double kEnhancedLookIntercept;
extern const EnhancedLook kEnhancedLookWeights;

}  // namespace anchorsplat
