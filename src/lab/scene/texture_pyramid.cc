#include "scene/texture_pyramid.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace anchorsplat {

namespace {

// Source texels covered by target texel i when `from` texels become `to`, with weights.
struct Span {
  int first = 0;
  int count = 0;
  float weight[4] = {};  // from/to is below 3 plus rounding, so at most four are touched
};

std::vector<Span> SpansOf(int from, int to) {
  std::vector<Span> spans(static_cast<size_t>(to));
  for (int i = 0; i < to; ++i) {
    const double begin = static_cast<double>(i) * from / to;
    const double end = static_cast<double>(i + 1) * from / to;
    Span& span = spans[static_cast<size_t>(i)];
    span.first = static_cast<int>(begin);
    const int last = std::min(from, static_cast<int>(std::ceil(end)));
    span.count = std::clamp(last - span.first, 1, 4);
    for (int k = 0; k < span.count; ++k) {
      const double low = std::max(begin, static_cast<double>(span.first + k));
      const double high = std::min(end, static_cast<double>(span.first + k + 1));
      span.weight[k] = static_cast<float>((high - low) / (end - begin));
    }
  }
  return spans;
}

uint8_t Rounded(float value) { return static_cast<uint8_t>(std::clamp(value + 0.5f, 0.0f, 255.0f)); }

}  // namespace

TexturePyramid::TexturePyramid(const Texture& texture) {
  levels_.push_back({texture.width, texture.height, texture.rgba});
  while (levels_.back().width > 1 || levels_.back().height > 1) levels_.push_back(Halved(levels_.back()));
}

TexturePyramid::Level TexturePyramid::Halved(const Level& from) {
  Level to;
  to.width = std::max(1, from.width / 2);
  to.height = std::max(1, from.height / 2);
  to.rgba.resize(static_cast<size_t>(to.width) * static_cast<size_t>(to.height) * 4);
  const std::vector<Span> columns = SpansOf(from.width, to.width);
  const std::vector<Span> rows = SpansOf(from.height, to.height);
  uint8_t* out = to.rgba.data();
  for (const Span& row : rows) {
    for (const Span& column : columns) {
      float weighted[3] = {}, plain[3] = {}, alpha = 0;
      for (int j = 0; j < row.count; ++j) {
        for (int i = 0; i < column.count; ++i) {
          const uint8_t* texel = &from.rgba[(static_cast<size_t>(row.first + j) * static_cast<size_t>(from.width) +
                                             static_cast<size_t>(column.first + i)) *
                                            4];
          const float w = row.weight[j] * column.weight[i];
          alpha += w * texel[3];
          for (int c = 0; c < 3; ++c) {
            plain[c] += w * texel[c];
            weighted[c] += w * texel[3] * texel[c];
          }
        }
      }
      for (int c = 0; c < 3; ++c) out[c] = Rounded(alpha > 0 ? weighted[c] / alpha : plain[c]);
      out[3] = Rounded(alpha);
      out += 4;
    }
  }
  return to;
}

TexturePyramid::Taps TexturePyramid::FindTaps(float u, float v, int level) const {
  const Level& from = levels_[static_cast<size_t>(std::clamp(level, 0, levels() - 1))];
  // Texel centres are at ½; v increases upwards, rows downwards.
  const float x = (u - std::floor(u)) * static_cast<float>(from.width) - 0.5f;
  const float y = (1 - (v - std::floor(v))) * static_cast<float>(from.height) - 0.5f;
  const int left = static_cast<int>(x + 1) - 1;  // floor: x ≥ −½
  const int top = static_cast<int>(y + 1) - 1;
  const float fx = x - static_cast<float>(left), fy = y - static_cast<float>(top);
  const int x0 = left < 0 ? from.width - 1 : std::min(left, from.width - 1);
  const int x1 = left + 1 >= from.width ? 0 : left + 1;
  const int y0 = top < 0 ? from.height - 1 : std::min(top, from.height - 1);
  const int y1 = top + 1 >= from.height ? 0 : top + 1;
  const uint8_t* upper = from.rgba.data() + static_cast<size_t>(y0) * static_cast<size_t>(from.width) * 4;
  const uint8_t* lower = from.rgba.data() + static_cast<size_t>(y1) * static_cast<size_t>(from.width) * 4;
  return {{upper + 4 * x0, upper + 4 * x1, lower + 4 * x0, lower + 4 * x1},
          {(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy}};
}

std::array<float, 4> TexturePyramid::Sample(float u, float v, int level) const {
  const Taps taps = FindTaps(u, v, level);
  std::array<float, 4> out = {};
  for (int k = 0; k < 4; ++k) {
    for (size_t c = 0; c < 4; ++c) out[c] += taps.weight[k] * static_cast<float>(taps.texel[k][c]);
  }
  for (float& x : out) x *= 1.0f / 255;
  return out;
}

float TexturePyramid::SampleAlpha(float u, float v, int level) const {
  const Taps taps = FindTaps(u, v, level);
  float alpha = 0;
  for (int k = 0; k < 4; ++k) alpha += taps.weight[k] * static_cast<float>(taps.texel[k][3]);
  return alpha * (1.0f / 255);
}

int LevelOfFootprint(float texels) {
  // round(½ log₂ t) = ⌊½ log₂ 2t⌋, and ⌊log₂⌋ is a float's exponent.
  if (!(texels > 0.5f)) return 0;
  const int exponent = static_cast<int>((std::bit_cast<uint32_t>(2 * std::min(texels, 1e30f)) >> 23) & 255) - 127;
  return exponent / 2;
}

}  // namespace anchorsplat
