#pragma once

#include <anchorsplat/error.h>
#include <anchorsplat/export.h>
#include <anchorsplat/picture.h>
#include <anchorsplat/run.h>

#include <span>
#include <string>

namespace anchorsplat {

// Peak signal-to-noise ratio in dB over the first three channels, peak 1; infinite for equal pictures. Values are not
// clamped: clamp renders first. kBadArgument: different shapes, empty pictures.
ANCHORSPLAT_PUBLIC Expected<double> Psnr(const Picture& a, const Picture& b, const RunSettings& run = {});

// Mean structural similarity (Wang et al. 2004), 11×11 Gaussian window. kBadArgument as above.
ANCHORSPLAT_PUBLIC Expected<double> Ssim(const Picture& a, const Picture& b, const RunSettings& run = {});

struct CaptionedPicture {
  std::string caption;  // "before"
  const Picture* picture = nullptr;
};

// A picture for people: one column per picture with caption, an enlargement of where they differ most, and differences
// to the last picture. kBadArgument: no pictures, or different or empty sizes.
ANCHORSPLAT_PUBLIC Expected<Picture> ComparisonSheet(std::span<const CaptionedPicture> pictures,
                                                     const RunSettings& run = {});

}  // namespace anchorsplat
