#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>

#include "core/image.h"
#include "core/result.h"
#include "io/write_options.h"

namespace anchorsplat {

// Reads a PNG, JPEG, WebP or TIFF, detected by content, as floats value/255 (16-bit: /65535): 3 channels, or 4 if the
// file has alpha. Grey and palettes become rgb; CMYK JPEGs become rgb without a colour profile, (1 − c)·(1 − k). Pixels
// are as stored: the caller applies the EXIF orientation (images/orientation.h). TIFFs (8 or 16 bits, grey or rgb) and
// WebPs must contain a single image. Errors: kNotFound, kIo, kBadFile.
Result<Image> ReadImage(const std::filesystem::path& path);

// Width and height as stored, and EXIF orientation (1 to 8; 1 if absent), without decoding pixels.
struct ImageSize {
  int width = 0;
  int height = 0;
  int orientation = 1;
};
Result<ImageSize> ReadImageSize(const std::filesystem::path& path);

// Writes an 8-bit PNG (1, 3 or 4 channels): value·255, clamped and rounded to nearest. All or nothing. A non-empty
// `comment` (ASCII) is stored in the file.
Status WritePng(const std::filesystem::path& path, const Image& image, const WriteOptions& options = {},
                const std::string& comment = {});

// rgb·a + background·(1−a); images without alpha are returned unchanged.
Image CompositeOver(const Image& image, const std::array<float, 3>& background);

}  // namespace anchorsplat
