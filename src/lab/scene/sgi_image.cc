#include "scene/sgi_image.h"

#include <algorithm>

#include "core/text.h"

namespace anchorsplat {

namespace {

constexpr size_t kHeader = 512;

uint32_t Big(std::string_view bytes, size_t at, size_t size) {
  uint32_t value = 0;
  for (size_t k = 0; k < size; ++k) value = value << 8 | static_cast<uint8_t>(bytes[at + k]);
  return value;
}

// Decodes a run-length encoded row: a count with the top bit set precedes that many values, without it a value to
// repeat;
// 0 ends. False if the row is too short or too long.
bool Unpack(std::string_view packed, size_t sample, std::vector<uint8_t>& row) {
  size_t at = 0, filled = 0;
  while (at + sample <= packed.size()) {
    const uint32_t code = Big(packed, at, sample) & 0xff;
    at += sample;
    const size_t count = code & 0x7f;
    if (count == 0) break;
    if (filled + count > row.size()) return false;
    const bool copy = (code & 0x80) != 0;
    if (at + (copy ? count : 1) * sample > packed.size()) return false;
    for (size_t k = 0; k < count; ++k) row[filled + k] = static_cast<uint8_t>(packed[at + (copy ? k : 0) * sample]);
    at += (copy ? count : 1) * sample;
    filled += count;
  }
  return filled == row.size();
}

}  // namespace

bool IsSgi(std::string_view bytes) {
  return bytes.size() >= kHeader && Big(bytes, 0, 2) == 474 && static_cast<uint8_t>(bytes[2]) <= 1 &&
         (bytes[3] == 1 || bytes[3] == 2);
}

Result<SgiImage> DecodeSgi(const std::string& where, std::string_view bytes, int64_t max_pixels) {
  const auto bad = [&](size_t at, const std::string& what) {
    return Error{ErrorCode::kBadFile, Cat(where, ": byte ", at, ": ", what)};
  };
  if (!IsSgi(bytes)) return bad(0, "not an SGI picture");
  const bool packed = bytes[2] == 1;
  const auto sample = static_cast<size_t>(bytes[3]);
  const uint32_t dimensions = Big(bytes, 4, 2);
  const size_t width = Big(bytes, 6, 2);
  const size_t height = dimensions < 2 ? 1 : Big(bytes, 8, 2);
  const size_t channels = dimensions < 3 ? 1 : Big(bytes, 10, 2);
  if (dimensions < 1 || dimensions > 3 || width == 0 || height == 0 || channels < 1 || channels > 4) {
    return bad(4, Cat("a picture of ", width, " x ", height, " with ", channels, " channels"));
  }
  if (static_cast<int64_t>(width * height) > max_pixels) return bad(6, "too many pixels for a texture");
  const size_t rows = height * channels;
  // A packed row takes at least two bytes per 127 values, a raw one its size. Checked before allocating.
  const size_t tables = packed ? rows * 8 : 0;
  const size_t least = kHeader + tables + (packed ? 0 : rows * width * sample);
  if (bytes.size() < least) return bad(bytes.size(), Cat("the file ends before byte ", least));

  SgiImage image;
  image.width = static_cast<int>(width);
  image.height = static_cast<int>(height);
  image.rgba.assign(width * height * 4, 255);
  std::vector<uint8_t> row(width);
  for (size_t c = 0; c < channels; ++c) {
    // Grey fills r, g and b; the second of two or fourth of four channels is alpha.
    const bool alpha = (channels == 2 && c == 1) || c == 3;
    for (size_t y = 0; y < height; ++y) {
      const size_t r = c * height + y;
      if (packed) {
        const size_t start = Big(bytes, kHeader + 4 * r, 4);
        const size_t length = Big(bytes, kHeader + 4 * rows + 4 * r, 4);
        if (start > bytes.size() || length > bytes.size() - start) {
          return bad(kHeader + 4 * r, Cat("row ", y, " lies outside the file"));
        }
        if (!Unpack(bytes.substr(start, length), sample, row)) return bad(start, Cat("row ", y, " is damaged"));
      } else {
        for (size_t x = 0; x < width; ++x) {
          row[x] = static_cast<uint8_t>(bytes[kHeader + (r * width + x) * sample]);
        }
      }
      uint8_t* out = image.rgba.data() + (height - 1 - y) * width * 4;  // files start at the bottom
      for (size_t x = 0; x < width; ++x) {
        if (alpha) {
          out[4 * x + 3] = row[x];
        } else if (channels <= 2) {
          std::fill_n(out + 4 * x, 3, row[x]);
        } else {
          out[4 * x + c] = row[x];
        }
      }
    }
  }
  return image;
}

}  // namespace anchorsplat
