#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "core/buffer.h"

namespace anchorsplat {

// A layer's output: [H+2, W+2, C], channels of a pixel contiguous, with a zero border one pixel wide. So a 3×3
// convolution sees the zero padding it was trained with, and three pixels of a row are 3·C contiguous floats.
class FeatureMap {
 public:
  int64_t width() const { return width_; }
  int64_t height() const { return height_; }
  int64_t channels() const { return channels_; }

  // Sets the shape, reusing memory; zeroes the border and leaves the inside undefined.
  void Reshape(int64_t width, int64_t height, int64_t channels) {
    width_ = width;
    height_ = height;
    channels_ = channels;
    values_.resize(static_cast<size_t>((width + 2) * (height + 2) * channels));
    const auto zero = [&](int64_t x, int64_t y, int64_t pixels) {
      std::memset(pixel(x, y), 0, static_cast<size_t>(pixels * channels) * sizeof(float));
    };
    zero(-1, -1, width + 2);
    zero(-1, height, width + 2);
    for (int64_t y = 0; y < height; ++y) {
      zero(-1, y, 1);
      zero(width, y, 1);
    }
  }

  // Channels of a pixel, −1 ≤ x ≤ W and −1 ≤ y ≤ H; the next pixel of the row follows.
  float* pixel(int64_t x, int64_t y) { return values_.data() + ((y + 1) * (width_ + 2) + x + 1) * channels_; }
  const float* pixel(int64_t x, int64_t y) const {
    return values_.data() + ((y + 1) * (width_ + 2) + x + 1) * channels_;
  }

 private:
  int64_t width_ = 0;
  int64_t height_ = 0;
  int64_t channels_ = 0;
  Buffer<float> values_;
};

}  // namespace anchorsplat
