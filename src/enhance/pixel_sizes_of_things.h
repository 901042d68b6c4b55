#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/buffer.h"
#include "core/gaussian_cloud.h"
#include "enhance/pixel_size_guard.h"

namespace anchorsplat {

// One of the things of a splat that lie apart (cloud_components.h), looked at as if it were alone.
struct ThingPixelSize {
  int64_t gaussians = 0;
  PixelSizeFinding finding;
};

struct PixelSizesOfThings {
  std::vector<ThingPixelSize> things;  // the largest first; empty where one size is that of all
  Buffer<float> sizes;                 // [N], world units; as empty
  std::vector<char> sure;              // [N], 1: of things whose own estimate nothing contradicts; as empty
};

// "2 things that lie apart, and each gets what its own outlines say of a training pixel: 80,000 Gaussians, 0.09 at most
// (it lies around others); 20,000 Gaussians, 0.005"; the smaller ones of many are counted.
std::string InWords(std::span<const ThingPixelSize> things);
std::vector<std::string> ContradictionsOf(std::span<const ThingPixelSize> things);

// Of a splat whose things were trained at pixels of different size, as they are where somebody has merged splats. One
// estimate for all of them would blur the finer ones, by whichever share of the Gaussians they are.
// `whole`: FindPixelSize of the cloud. Where nothing contradicts that and the things say something like it, they may be
// of one training, and each gets the smaller one of both; where they say the same, `whole` is right, and nothing is
// found. What lies around other things has outlines that were not seen as such, and is treated with caution.
PixelSizesOfThings FindPixelSizesOfThings(const GaussianCloud& cloud, const PixelSizeFinding& whole);

}  // namespace anchorsplat
