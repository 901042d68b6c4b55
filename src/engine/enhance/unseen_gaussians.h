#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"

namespace anchorsplat {

// Gaussians that cannot be seen over the training background, such as black dust and veils around objects on black,
// which show on any other background. They have the background's colour (SH DC within kLikeBackground per channel), are
// drawn in some view, and removing them does not visibly change the views.
//
// This includes dark parts of an object on black with nothing bright behind them: pictures cannot tell them apart.
struct UnseenOptions {
  std::array<float, 3> background{};  // rgb 0–1, of the training views
  double least_psnr = 50;             // dB, in every view, of renders without them against renders with them
  uint64_t seed = 0;
};
inline constexpr float kLikeBackground = 0.1f;

struct UnseenGaussians {
  std::vector<int64_t> rows;  // ascending
  double psnr = 0;            // of the worst view, without against with them; +Inf if no pixel changes
  int64_t views = 0;          // views compared: at most 48, of at most 512 pixels a side
};

// Searches in the views of `cameras`, or in views all around if there are none. A Gaussian's contribution to a picture
// is Σ over pixels of (T·α·(its colour − what is behind it))². One gradient per view with random signs gives it in
// expectation. Removes the smallest contributions, as many as least_psnr allows, within a hundredth. Memory: the
// blending state of the cloud, one picture's gradient, and the pictures. Shows progress.
// Errors: those of Rasterizer; kBadArgument: least_psnr not positive, background not in 0–1, no view shows anything;
// kInterrupted: the user stopped it.
Result<UnseenGaussians> FindUnseen(const GaussianCloud& cloud, const std::vector<Camera>& cameras,
                                   const UnseenOptions& options);

// Predicts such rows, ascending, without verifying: those whose summed contributions leave 75 dB over black in a few
// small views all around. Excludes Gaussians that are mostly occluded, as the inside of a room is from outside. Takes a
// tenth of a second for 20,000 Gaussians.
// Errors: those of Rasterizer; kInterrupted.
Result<std::vector<int64_t>> PredictUnseen(const GaussianCloud& cloud);

}  // namespace anchorsplat
