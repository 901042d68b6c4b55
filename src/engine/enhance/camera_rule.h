#pragma once

#include <string>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "enhance/pixel_size.h"

namespace anchorsplat {

// Which of the two rules suits these cameras: the median where they look at one thing from all around, the smallest
// otherwise, as it never blurs. All of this has to hold for the median: the axes meet near one point in front of the
// cameras, from which they stand equally far and see it in pixels of one size, on more than one side, and the splat
// lies between them, not around them.
struct CameraRuleChoice {
  CameraPixelRule rule = CameraPixelRule::kSmallest;
  std::string why;  // the end of a sentence: "the cameras look at one thing from all around"
};
CameraRuleChoice ChooseCameraRule(const GaussianCloud& cloud, const CameraSet& cameras);

}  // namespace anchorsplat
