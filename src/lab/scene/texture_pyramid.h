#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "scene/mesh.h"

namespace anchorsplat {

// A texture and its smaller copies (Williams 1983), each half the size of the one before down to 1×1: a sample whose
// footprint covers 4^l texels reads four texels of level l. Values are averaged as stored (no gamma), which is what
// programs that make such views do; colours are weighted by alpha, so that what lies under transparent texels does not
// bleed into their neighbours. Sizes need not be powers of two: every texel is the exact average of the area it covers.
class TexturePyramid {
 public:
  explicit TexturePyramid(const Texture& texture);  // a valid one (Validate)

  int levels() const { return static_cast<int>(levels_.size()); }
  int width() const { return levels_[0].width; }
  int height() const { return levels_[0].height; }

  // Bilinear, repeating in both directions; (0,0) is the lower left corner. Level is clamped to what there is.
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

// The level whose texels are nearest in size to a footprint of `texels` texels of level 0: round(log₄ texels), from 0.
int LevelOfFootprint(float texels);

}  // namespace anchorsplat
