#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string_view>

#include "core/camera.h"
#include "core/image.h"
#include "core/result.h"

namespace anchorsplat {

// What real photographs and their reconstruction have and clean renders have not. Everything 0: none of it. Lengths are
// pixels of the picture that the defects are done to.
struct PictureDefects {
  double noise = 0;     // σ of every value, of 255
  int jpeg = 0;         // quality, 1 to 100, of a baseline JPEG with colours at half the resolution
  double exposure = 0;  // every picture is brighter or darker by up to this share
  double pose = 0;      // px by which every camera's aim is off, in a direction of its own
  double mask = 0;      // px that the mask cuts off all along the outline
  double defocus = 0;   // px, σ of the blur

  bool InPictures() const { return noise > 0 || jpeg > 0 || exposure > 0 || mask > 0 || defocus > 0; }
  bool Any() const { return InPictures() || pose > 0; }
  friend bool operator==(const PictureDefects&, const PictureDefects&) = default;
};

// kBadArgument: negative or absurd values: noise above 255, an exposure above 1, blur, cuts and poses above 64 px.
Status Validate(const PictureDefects& defects);

// The photograph of `picture` [3 or 4,H,W], 0–1, straight alpha: laid over the background, out of focus, exposed,
// noisy, compressed, and last cut out by its mask, outside of which is exactly the background again. The mask is where
// alpha is above 0 after the blur; one that cuts is where alpha, eroded by a disc, is at least ½. Without alpha all is
// object. The result is [3,H,W]. `name` (of the view) and `seed` alone decide what is random.
// Errors: kIo: libjpeg has no memory.
Result<Image> WithDefects(const Image& picture, const PictureDefects& defects, const std::array<float, 3>& background,
                          std::string_view name, uint64_t seed);

// The camera turned about its own centre until what was in the middle of the picture is `defects.pose` pixels away from
// it, in a direction that `seed` and the camera's name decide.
Camera WithWrongAim(const Camera& camera, const PictureDefects& defects, uint64_t seed);

// The project that a fit is to see instead of `low`, a folder with images/ and sparse/0 as view_set.h writes it: `to`
// gets defective pictures and wrong poses. Every `hold_out`-th view by name (0: none) is kept as it is, picture and
// pose, because it tells what the fit is worth; points3D.bin is copied. What is in `to` is replaced.
//
// Errors: kNotFound, kBadFile, kIo of the pictures and cameras; kBadArgument as Validate.
Status WriteCapturedProject(const std::filesystem::path& low, const std::filesystem::path& to,
                            const PictureDefects& defects, const std::array<float, 3>& background, int hold_out,
                            uint64_t seed);
inline constexpr const char* kCapturedName = "captured";  // of that folder, beside the low one

}  // namespace anchorsplat
