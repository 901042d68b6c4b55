#pragma once

#include <string>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "enhance/pixel_size.h"

namespace anchorsplat {

// Chooses the pixel rule for these cameras: the median if they look at one object from all around, else the smallest,
// which never blurs. The median requires all of: axes meet near one point in front of the cameras; cameras are equally
// far from it, with equal pixel sizes, on more than one side; the splat lies between them, not around them.
struct CameraRuleChoice {
  CameraPixelRule rule = CameraPixelRule::kSmallest;
  std::string why;  // the end of a sentence: "the cameras look at one thing from all around"
};
CameraRuleChoice ChooseCameraRule(const GaussianCloud& cloud, const CameraSet& cameras);

}  // namespace anchorsplat
