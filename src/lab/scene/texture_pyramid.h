#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "scene/mesh.h"

namespace anchorsplat {

// A mip pyramid (Williams 1983), each level half the size of the previous one down to 1×1: a sample whose footprint
// covers 4^l texels reads level l. Averages stored values (no gamma), as programs that render such views do. Colours
// are weighted by alpha, so that transparent texels do not bleed. Sizes need not be powers of two: each texel is the
// exact average of the area it covers.
class TexturePyramid {
 public:
  explicit TexturePyramid(const Texture& texture);  // must be valid (Validate)

  int levels() const { return static_cast<int>(levels_.size()); }
  int width() const { return levels_[0].width; }
  int height() const { return levels_[0].height; }

  // Bilinear, repeating; (0,0) is the lower left corner. Clamps `level`.
  std::array<float, 4> Sample(float u, float v, int level) const;  // rgba 0–1
  float SampleAlpha(float u, float v, int level) const;

 private:
  struct Level {
    int width = 0;
    int height = 0;
    std::vector<uint8_t> rgba;  // [H,W,4]
  };
  struct Taps {
    const uint8_t* texel[4];
    float weight[4];
  };
  Taps FindTaps(float u, float v, int level) const;
  static Level Halved(const Level& from);

  std::vector<Level> levels_;
};

// Level whose texel size is nearest to a footprint of `texels` level-0 texels: round(log₄ texels), at least 0.
int LevelOfFootprint(float texels);

}  // namespace anchorsplat
