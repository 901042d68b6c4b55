#pragma once

namespace anchorsplat {

// Which pixels a Gaussian may touch (docs/method.md); rasterizers disagree beyond three sigma.
enum class RasterProfile {
  kGsplat14,  // gsplat 1.0–1.4: square of ceil(3σ_max) pixels, rounded out to 16-px tiles (default)
  kGsplat15,  // gsplat 1.5: per axis min(3.33, sqrt(2 ln(255·opacity)))·σ, rounded out to 16-px tiles
};

}  // namespace anchorsplat
