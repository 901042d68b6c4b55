#include "upscale/pixel_shuffle.h"

#include <cstdint>

#include "core/parallel.h"

namespace anchorsplat {

void PixelShuffle(const FeatureMap& map, const PixelBox& box, int scale, int to_x, int to_y, Image& out) {
  constexpr int64_t kRows = 8;
  ParallelFor(box.y0, box.y1, kRows, [&](int64_t begin, int64_t end) {
    for (int64_t y = begin; y < end; ++y) {
      for (int c = 0; c < out.channels; ++c) {
        for (int j = 0; j < scale; ++j) {
          float* row = out.channel(c) + (to_y + (y - box.y0) * scale + j) * out.width + to_x;
          const float* in = map.pixel(box.x0, y) + int64_t{c * scale + j} * scale;
          for (int x = box.x0; x < box.x1; ++x, in += map.channels(), row += scale) {
            for (int i = 0; i < scale; ++i) row[i] = in[i];
          }
        }
      }
    }
  });
}

}  // namespace anchorsplat
