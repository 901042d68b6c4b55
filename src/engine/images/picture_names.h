#pragma once

#include <filesystem>
#include <string>

namespace anchorsplat {

// File name extensions of images, in upper or lower case.
//
// Types that ReadImage reads: PNG, JPEG, WebP, TIFF.

// One that ReadImage reads: PNG, JPEG, WebP, TIFF.
bool HasPictureExtension(const std::filesystem::path& path);
inline constexpr const char* kPictureKinds = "PNG, JPEG, WebP or TIFF";

// Any image type that camera files may name: those, and HEIC, AVIF, BMP, EXR and others.
bool HasAnyPictureExtension(const std::filesystem::path& path);

}  // namespace anchorsplat
