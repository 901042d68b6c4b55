#pragma once

#include <anchorsplat/error.h>
#include <anchorsplat/export.h>

#include <cstdint>
#include <filesystem>
#include <vector>

namespace anchorsplat {

// Planar float picture: pixels[(c·height + y)·width + x]. Colours are 0–1 as in the file (sRGB values, no conversion),
// not premultiplied; channels r g b [a], or one alone.
struct Picture {
  int width = 0, height = 0, channels = 0;
  std::vector<float> pixels = {};  // [C,H,W]
};

// PNG, JPEG, WebP or TIFF: 3 channels, or 4 where the file has alpha. Failures: kNotFound, kIo, kBadFile.
ANCHORSPLAT_PUBLIC Expected<Picture> ReadPicture(const std::filesystem::path& path);

// An 8-bit PNG of 1, 3 or 4 channels: value·255 rounded to nearest, clamped. Whole or not at all.
// Failures: kExists, kNotFound (its folder), kIo; kBadArgument: another shape.
ANCHORSPLAT_PUBLIC Expected<void> WritePicture(const std::filesystem::path& path, const Picture& picture,
                                               bool overwrite = false);

}  // namespace anchorsplat
