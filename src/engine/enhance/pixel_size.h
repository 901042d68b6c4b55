#pragma once

#include <optional>
#include <string>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"

namespace anchorsplat {

// p_LR, the world size of one pixel in the views a splat was trained on: depth / focal length.

// Which of the views that hold a Gaussian decides. The smallest never blurs: it is right for scenes with close-ups,
// whose detail only the nearest views saw. The median is right for objects seen from all around at one distance, where
// the smallest is that of a view on the far side's axis, too small by the object's depth. kAuto is the one that suits
// the cameras (enhance/camera_rule.h).
enum class CameraPixelRule { kAuto, kSmallest, kMedian };

// From training cameras, one per Gaussian: smallest or median depth / sqrt(fx·fy) over the views whose image holds its
// mean in front of the near plane; for Gaussians that no view holds, the smallest distance / focal over all cameras.
// `train_width`: width in pixels at which the views were trained, where that is less than the cameras say (the focal
// length shrinks with it; cameras that are already narrower stay as they are).
// Rows whose mean is not finite get the median of the others. kBadArgument: no cameras, train_width < 1.
struct CameraPixelSizes {
  Buffer<float> sizes;                                // [N] world units
  float median = 0;                                   // of `sizes`
  int64_t unseen = 0;                                 // Gaussians that no view holds
  CameraPixelRule rule = CameraPixelRule::kSmallest;  // the one that was followed
  std::string why;                                    // it was chosen; empty where it was given
};
Result<CameraPixelSizes> PixelSizesFromCameras(const GaussianCloud& cloud, const CameraSet& cameras,
                                               std::optional<int> train_width,
                                               CameraPixelRule rule = CameraPixelRule::kAuto);

// The training width to assume when the user gives none. INRIA's trainer (and those after it) works at 1600 pixels
// where images are wider, while its cameras.json and COLMAP models keep the original size. Nothing to assume for
// narrower cameras and for transforms.json.
inline constexpr int kInriaTrainWidth = 1600;
std::optional<int> AssumedTrainWidth(const CameraSet& cameras);

}  // namespace anchorsplat
