#pragma once

#include <filesystem>
#include <string>

namespace anchorsplat {

// By the extension of a name, in any letters: "a/b.JPG" has a picture's.

// One that ReadImage reads: PNG, JPEG, WebP, TIFF.
bool HasPictureExtension(const std::filesystem::path& path);
inline constexpr const char* kPictureKinds = "PNG, JPEG, WebP or TIFF";

// One of any kind of picture, such as camera files may name: those, and HEIC, AVIF, BMP, EXR and the like.
bool HasAnyPictureExtension(const std::filesystem::path& path);

}  // namespace anchorsplat
