#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/result.h"

namespace anchorsplat {

// Gaussians that nobody misses over the background that a splat was trained on: black dust and veils around objects on
// black, which come to light on any other background. They have the background's colour, within kLikeBackground of it
// in every channel of the constant term, are drawn in some view, and renders of the views without them agree with those
// with them.
//
// Of dark parts of an object on black the pictures say as little: they go, too, where nothing bright is behind them.
struct UnseenOptions {
  std::array<float, 3> background{};  // rgb 0–1, of the training views
  double least_psnr = 50;             // dB of every view, between the renders with and without them
  uint64_t seed = 0;
};
inline constexpr float kLikeBackground = 0.1f;

struct UnseenGaussians {
  std::vector<int64_t> rows;  // ascending
  double psnr = 0;            // of the worst view, without them against with them; +Inf where no pixel changes
  int64_t views = 0;          // that were looked at: at most 48, of at most 512 pixels a side
};

// Of `cameras`, or of views all around where there are none. What a Gaussian adds to a picture, T·α·(its colour − what
// is behind it) summed in squares over the pixels, comes of one gradient per view with random signs: its expectation is
// that sum. Those that add least are taken out, as many as least_psnr allows, within a hundredth. Memory: what blending
// finds of the cloud, one picture's gradient, and the pictures. Shows progress.
// Errors: those of Rasterizer; kBadArgument: least_psnr is not positive, the background is not from 0 to 1, no view
// shows anything; kInterrupted: the user stopped it.
Result<UnseenGaussians> FindUnseen(const GaussianCloud& cloud, const std::vector<Camera>& cameras,
                                   const UnseenOptions& options);

// The same without trying: rows, ascending, of those that by the sum of what each adds leave 75 dB over black in a few
// small views from all around. Those that hardly reach a view, for what is in front of them, are none: what is inside
// a room is not seen from outside. A tenth of a second for 20,000 Gaussians.
// Errors: those of Rasterizer; kInterrupted.
Result<std::vector<int64_t>> PredictUnseen(const GaussianCloud& cloud);

}  // namespace anchorsplat
