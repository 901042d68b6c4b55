#include "images/picture_names.h"

#include <algorithm>
#include <iterator>

#include "core/ascii_lower_case.h"

namespace anchorsplat {

namespace {

constexpr const char* kReadable[] = {".png", ".jpg", ".jpeg", ".webp", ".tif", ".tiff"};
constexpr const char* kOthers[] = {".heic", ".heif", ".avif", ".bmp", ".gif", ".exr",
                                   ".hdr",  ".jxl",  ".jp2",  ".ppm", ".pgm", ".dng"};

bool IsOneOf(const std::filesystem::path& path, const auto& extensions) {
  const std::string extension = AsciiLowerCase(path.extension().string());
  return std::find(std::begin(extensions), std::end(extensions), extension) != std::end(extensions);
}

}  // namespace

bool HasPictureExtension(const std::filesystem::path& path) { return IsOneOf(path, kReadable); }

bool HasAnyPictureExtension(const std::filesystem::path& path) {
  return HasPictureExtension(path) || IsOneOf(path, kOthers);
}

}  // namespace anchorsplat
