#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string_view>

#include "core/camera.h"
#include "core/image.h"
#include "core/result.h"

namespace anchorsplat {

// Defects of real photographs and their reconstruction that clean renders lack; 0 disables each. Lengths are in pixels
// of the affected picture.
struct PictureDefects {
  double noise = 0;     // σ per value, of 255
  int jpeg = 0;         // quality, 1 to 100, of a baseline JPEG with colours at half the resolution
  double exposure = 0;  // maximum relative change of each picture's brightness
  double pose = 0;      // px by which each camera's aim is off, in a random direction
  double mask = 0;      // px cut off by the mask along the outline
  double defocus = 0;   // px, σ of the blur

  bool InPictures() const { return noise > 0 || jpeg > 0 || exposure > 0 || mask > 0 || defocus > 0; }
  bool Any() const { return InPictures() || pose > 0; }
  friend bool operator==(const PictureDefects&, const PictureDefects&) = default;
};

// kBadArgument: negative or absurd values: noise above 255, exposure above 1, blur, cuts or poses above 64 px.
Status Validate(const PictureDefects& defects);

// Simulates a photograph of `picture` [3 or 4,H,W], 0–1, straight alpha: composites over the background, then blurs,
// exposes, adds noise, compresses, and finally restores the exact background outside the mask. The mask is where alpha
// is above 0 after the blur or, with `mask` set, where alpha eroded by a disc is at least ½; without alpha, everywhere.
// Returns [3,H,W]. Randomness depends on `name` (of the view) and `seed` only.
// Errors: kIo: libjpeg has no memory.
Result<Image> WithDefects(const Image& picture, const PictureDefects& defects, const std::array<float, 3>& background,
                          std::string_view name, uint64_t seed);

// Rotates the camera about its centre by `defects.pose` pixels at the picture's centre, in a direction that depends on
// `seed` and the camera's name.
Camera WithWrongAim(const Camera& camera, const PictureDefects& defects, uint64_t seed);

// Writes to `to` the project for the fit, with defective pictures and wrong poses, from `low`, a folder with images/
// and sparse/0 as in view_set.h. Every `hold_out`-th view by name (0: none) stays intact, to evaluate the fit;
// points3D.bin is copied. Replaces the contents of `to`.
//
// Errors: kNotFound, kBadFile, kIo of pictures and cameras; kBadArgument as Validate.
Status WriteCapturedProject(const std::filesystem::path& low, const std::filesystem::path& to,
                            const PictureDefects& defects, const std::array<float, 3>& background, int hold_out,
                            uint64_t seed);
inline constexpr const char* kCapturedName = "captured";  // name of that folder, beside the low one

}  // namespace anchorsplat
