#pragma once

#include <anchorsplat/error.h>
#include <anchorsplat/export.h>

#include <cstdint>
#include <filesystem>
#include <vector>

namespace anchorsplat {

// Planar float picture: pixels[(c·height + y)·width + x]. Values are 0–1 as in the file (sRGB, not converted), not
// premultiplied. Channels: r g b [a], or a single one.
struct Picture {
  int width = 0, height = 0, channels = 0;
  std::vector<float> pixels = {};  // [C,H,W]
};

// Reads PNG, JPEG, WebP or TIFF: 3 channels, or 4 if the file has alpha. Failures: kNotFound, kIo, kBadFile.
ANCHORSPLAT_PUBLIC Expected<Picture> ReadPicture(const std::filesystem::path& path);

// Writes an 8-bit PNG of 1, 3 or 4 channels, atomically. Values are clamped and value·255 rounded to nearest.
// Failures: kExists; kNotFound: its folder; kIo; kBadArgument: another shape.
ANCHORSPLAT_PUBLIC Expected<void> WritePicture(const std::filesystem::path& path, const Picture& picture,
                                               bool overwrite = false);

}  // namespace anchorsplat
