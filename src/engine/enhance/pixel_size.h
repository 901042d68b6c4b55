#pragma once

#include <optional>
#include <span>
#include <string>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"

namespace anchorsplat {

// p_LR: world size of a pixel in the views a splat was trained on, depth / focal length.

// Which of the views that contain a Gaussian determines its pixel size. The smallest never blurs; it suits scenes with
// close-ups, whose detail only the nearest views saw. The median suits objects seen from all around at one distance,
// where the smallest is too small by the object's depth, as it comes from a view on the other side. kAuto picks the
// rule that suits the cameras (enhance/camera_rule.h).
enum class CameraPixelRule { kAuto, kSmallest, kMedian };

// Pixel sizes from training cameras, one per Gaussian: smallest or median depth / sqrt(fx·fy) over the views whose
// image contains its mean in front of the near plane. Gaussians in no view get the smallest distance / focal over all
// cameras; non-finite means get the median. The cameras have the size that was used in training (AtTrainWidth).
// kBadArgument: no cameras.
struct CameraPixelSizes {
  Buffer<float> sizes;                                // [N] world units
  float median = 0;                                   // of `sizes`
  int64_t unseen = 0;                                 // Gaussians in no view
  CameraPixelRule rule = CameraPixelRule::kSmallest;  // the rule used
  std::string why;                                    // reason for that rule; empty if it was given
};
Result<CameraPixelSizes> PixelSizesFromCameras(const GaussianCloud& cloud, const CameraSet& cameras,
                                               CameraPixelRule rule = CameraPixelRule::kAuto);

// Cameras of views at the size used in training: those wider than `train_width` pixels (at least 1) become that wide.
CameraSet AtTrainWidth(CameraSet cameras, int train_width);
int WidestOf(std::span<const Camera> cameras);  // pixels; 0 if there are none

// Training width to assume if the user gives none. INRIA's trainer and its successors reduce wider images to 1600
// pixels, but their cameras.json and COLMAP models keep the original size. Unset for narrower cameras and for
// transforms.json.
inline constexpr int kInriaTrainWidth = 1600;
std::optional<int> AssumedTrainWidth(const CameraSet& cameras);

}  // namespace anchorsplat
