#include "images/orientation.h"

#include <utility>

namespace anchorsplat {

namespace {

// For each pixel of the upright image, in order, the index in the stored image (width × height).
template <typename Take>
void ForUpright(int width, int height, int orientation, const Take& take) {
  const bool swaps = SwapsSides(orientation);
  const int out_width = swaps ? height : width, out_height = swaps ? width : height;
  int64_t to = 0;
  for (int y = 0; y < out_height; ++y) {
    for (int x = 0; x < out_width; ++x, ++to) {
      int column = swaps ? y : x, row = swaps ? x : y;
      // Position of the stored first row and column: 1 top left, 2 top right, 3 bottom right, 4 bottom left; with
      // swapped sides: 5 left top, 6 right top, 7 right bottom, 8 left bottom.
      if (orientation == 2 || orientation == 3 || orientation == 7 || orientation == 8) column = width - 1 - column;
      if (orientation == 3 || orientation == 4 || orientation == 6 || orientation == 7) row = height - 1 - row;
      take(to, int64_t{row} * width + column);
    }
  }
}

}  // namespace

int OrientationOfExif(std::string_view tiff) {
  if (tiff.size() < 8) return 1;
  const bool little = tiff.substr(0, 2) == "II";
  if (!little && tiff.substr(0, 2) != "MM") return 1;
  const auto number = [&](size_t at, size_t bytes) {  // within the block, as the callers ensure
    uint64_t value = 0;
    for (size_t i = 0; i < bytes; ++i) {
      value |= uint64_t{static_cast<unsigned char>(tiff[at + i])} << (8 * (little ? i : bytes - 1 - i));
    }
    return value;
  };
  constexpr uint64_t kEntry = 12, kOrientation = 0x0112, kShort = 3;
  const uint64_t directory = number(4, 4);
  if (number(2, 2) != 42 || directory > tiff.size() - 2) return 1;
  const uint64_t entries = number(directory, 2);
  for (uint64_t i = 0; i < entries; ++i) {
    const uint64_t at = directory + 2 + kEntry * i;
    if (at + kEntry > tiff.size()) return 1;
    if (number(at, 2) != kOrientation) continue;
    if (number(at + 2, 2) != kShort || number(at + 4, 4) != 1) return 1;
    const uint64_t value = number(at + 8, 2);
    return value >= 1 && value <= 8 ? static_cast<int>(value) : 1;
  }
  return 1;
}

Image Upright(Image image, int orientation) {
  if (orientation < 2 || orientation > 8) return image;
  const bool swaps = SwapsSides(orientation);
  Image out(swaps ? image.height : image.width, swaps ? image.width : image.height, image.channels);
  for (int c = 0; c < image.channels; ++c) {
    const float* from = image.channel(c);
    float* to = out.channel(c);
    ForUpright(image.width, image.height, orientation, [&](int64_t i, int64_t stored) { to[i] = from[stored]; });
  }
  return out;
}

Buffer<uint8_t> Upright(const Buffer<uint8_t>& values, int width, int height, int orientation) {
  if (orientation < 2 || orientation > 8) return values;
  Buffer<uint8_t> out(values.size());
  ForUpright(width, height, orientation,
             [&](int64_t i, int64_t stored) { out[static_cast<size_t>(i)] = values[static_cast<size_t>(stored)]; });
  return out;
}

}  // namespace anchorsplat
