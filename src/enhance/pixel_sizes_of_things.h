#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/buffer.h"
#include "core/gaussian_cloud.h"
#include "enhance/pixel_size_guard.h"
#include "enhance/trained_kind.h"

namespace anchorsplat {

// One of the things of a splat that lie apart (cloud_components.h), looked at as if it were alone.
struct ThingPixelSize {
  int64_t gaussians = 0;
  PixelSizeFinding finding;
};

struct PixelSizesOfThings {
  // The largest first, at last all that is not looked at; empty where one size is that of all.
  std::vector<ThingPixelSize> things;
  Buffer<float> sizes;     // [N], world units; as empty
  std::vector<char> sure;  // [N], 1: of things whose own estimate nothing contradicts; as empty
};

// "2 things that lie apart, each with a training pixel of its own: 80,000 Gaussians, 0.09 at most (it lies around
// others); 20,000 Gaussians, 0.005"; the smaller ones of many are counted.
std::string InWords(std::span<const ThingPixelSize> things);
std::vector<std::string> ContradictionsOf(std::span<const ThingPixelSize> things);

// Of a splat whose things were trained at pixels of different size, as they are where somebody has merged splats. One
// estimate for all of them would blur the finer ones, by whichever share of the Gaussians they are.
// `whole`: FindPixelSize of the cloud. Where nothing contradicts that and the things say something like it, they may be
// of one training, and each gets the smaller one of both; where they say the same, `whole` is right, and nothing is
// found. What has few Gaussians, whose outlines are not believed in full, and says about what `whole` does is
// of that training. Treated with caution is what lies around other things, as its outlines were not seen as such, and
// what is too small to tell. A thing that has lost no width stays as it is.
// `kinds`: whether things are looked at for that; nobody has said how the splat was trained. `harmonics`: where those
// of the cloud are if it has none.
PixelSizesOfThings FindPixelSizesOfThings(const GaussianCloud& cloud, const PixelSizeFinding& whole, bool kinds,
                                          const WholeCloud& harmonics = {});

}  // namespace anchorsplat
