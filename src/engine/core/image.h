#pragma once

#include <algorithm>
#include <cstdint>

#include "core/buffer.h"

namespace anchorsplat {

// Largest picture or view. Bounds allocations that a small file or flag can cause to a few GB, and keeps pixel
// coordinates and their squares accurate in float.
inline constexpr int kMaxImageSide = 1 << 19;
inline constexpr int64_t kMaxImagePixels = int64_t{1} << 28;

// Planar float image: pixels[(c·height + y)·width + x]. Colours are 0–1 as in the file (value/255, no colour-space
// conversion), not premultiplied. Channels are r g b [a], or one for depth or alpha alone.
struct Image {
  int width = 0;
  int height = 0;
  int channels = 0;
  Buffer<float> pixels;  // [C,H,W]

  Image() = default;
  Image(int w, int h, int c)
      : width(w),
        height(h),
        channels(c),
        pixels(static_cast<size_t>(w) * static_cast<size_t>(h) * static_cast<size_t>(c)) {}

  int64_t plane() const { return int64_t{width} * height; }
  float* channel(int c) { return pixels.data() + c * plane(); }
  const float* channel(int c) const { return pixels.data() + c * plane(); }
  float& at(int c, int y, int x) { return pixels[static_cast<size_t>((int64_t{c} * height + y) * width + x)]; }
  float at(int c, int y, int x) const { return pixels[static_cast<size_t>((int64_t{c} * height + y) * width + x)]; }
};

// Pixels [x0, x1) × [y0, y1); empty if x0 ≥ x1 or y0 ≥ y1.
struct PixelBox {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;

  bool empty() const { return x0 >= x1 || y0 >= y1; }
  friend bool operator==(const PixelBox&, const PixelBox&) = default;
};

// Copies the part of `image` inside `box`, which must lie within it. Reuses the memory of `out` if the shape matches.
inline void CropInto(const Image& image, const PixelBox& box, Image& out) {
  const int width = box.x1 - box.x0, height = box.y1 - box.y0;
  if (out.width != width || out.height != height || out.channels != image.channels) {
    out = Image(width, height, image.channels);
  }
  for (int c = 0; c < image.channels; ++c) {
    for (int y = 0; y < height; ++y) {
      std::copy_n(image.channel(c) + int64_t{box.y0 + y} * image.width + box.x0, width,
                  out.channel(c) + int64_t{y} * width);
    }
  }
}
inline Image Crop(const Image& image, const PixelBox& box) {
  Image out;
  CropInto(image, box, out);
  return out;
}

}  // namespace anchorsplat
