#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>

#include "core/image.h"
#include "core/result.h"
#include "io/write_options.h"

namespace anchorsplat {

// Reads a PNG, JPEG, WebP or TIFF (found by content) as floats value/255 (16-bit: /65535): 3 channels, or 4 where the
// file has alpha. Grey becomes rgb, a palette the colours in it, CMYK of a JPEG rgb without a profile: (1 − c)·(1 − k).
// Rows and columns are those of the file: an EXIF orientation is for the caller to apply (images/orientation.h). Of a
// TIFF (8 or 16 bits, grey or rgb) and a WebP the one picture that is in it. Errors: kNotFound, kIo, kBadFile.
Result<Image> ReadImage(const std::filesystem::path& path);

// Width and height as stored, without decoding the pixels, and EXIF's orientation, 1 to 8, where the file has one.
struct ImageSize {
  int width = 0;
  int height = 0;
  int orientation = 1;
};
Result<ImageSize> ReadImageSize(const std::filesystem::path& path);

// Writes an 8-bit PNG: value·255 rounded to nearest, clamped; 1 (grey), 3 or 4 channels. Whole or not at all. The file
// says the `comment`, ASCII, where there is one.
Status WritePng(const std::filesystem::path& path, const Image& image, const WriteOptions& options = {},
                const std::string& comment = {});

// rgb·a + background·(1−a); images without alpha come back as they are.
Image CompositeOver(const Image& image, const std::array<float, 3>& background);

}  // namespace anchorsplat
