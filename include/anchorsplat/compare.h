#pragma once

#include <anchorsplat/error.h>
#include <anchorsplat/export.h>
#include <anchorsplat/picture.h>
#include <anchorsplat/run.h>

#include <span>
#include <string>

namespace anchorsplat {

// Peak signal-to-noise ratio in dB over the first three channels, peak 1; infinite for equal pictures. Values are taken
// as they are: clamp renders first. kBadArgument: shapes differ, empty pictures.
ANCHORSPLAT_PUBLIC Expected<double> Psnr(const Picture& a, const Picture& b, const RunSettings& run = {});

// Mean structural similarity (Wang et al. 2004), 11×11 Gaussian window. kBadArgument as above.
ANCHORSPLAT_PUBLIC Expected<double> Ssim(const Picture& a, const Picture& b, const RunSettings& run = {});

struct CaptionedPicture {
  std::string caption;  // "before"
  const Picture* picture = nullptr;
};

// A picture for people: a column per picture with its caption, the part enlarged where they differ most, and the
// differences to the last one. kBadArgument: none, or pictures of different or empty sizes.
ANCHORSPLAT_PUBLIC Expected<Picture> ComparisonSheet(std::span<const CaptionedPicture> pictures,
                                                     const RunSettings& run = {});

}  // namespace anchorsplat
