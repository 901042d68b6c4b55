#pragma once

#include <torch/torch.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/buffer.h"
#include "core/image.h"
#include "train/train_config.h"

namespace anchorsplat {

// Target of a rendered view.
struct TrueView {
  Image picture;                      // [3,H,W], over the background
  std::array<float, 3> background{};  // same as the render's
  PixelBox object;                    // bounding box of pixels that differ from the background; empty: none
  PixelBox perceptual;                // region for LPIPS; empty: none
  Buffer<uint8_t> ignored;            // [H,W] not 0: no target there; empty: none ignored
};

// Loss terms of one view, for the log. With d = min(render, 1) − truth, W·H pixels of three channels, and F the number
// of foreground pixels: those where the truth differs from its background by more than 0.004 (one 8-bit step) in a
// channel, or the render differs from it at all,
//   l1      Σ|d| / F                        sum over channels, as in AnchorSplat's release
//   ssim    Σ(1 − SSIM) / 3F                over windows inside the picture
//   mse     Σd² / 3F
//   log_mse ln(Σd² / 3WH + 1e-7)            PSNR up to a factor, so that easy and hard views count alike
// Means over the foreground do not depend on the empty space around an object. Views without foreground are left out.
struct PhotometricTerms {
  double total = 0;
  double l1 = 0, ssim = 0, mse = 0, log_mse = 0;
  double psnr = 0;         // dB, of the whole picture
  int64_t foreground = 0;  // F
};

struct PhotometricLossSum {
  torch::Tensor loss;                   // mean of `total` over views with foreground; 0 without any
  std::vector<PhotometricTerms> terms;  // per view
};

// Computes the weighted sum of the terms together with its gradient; one view per thread. `rendered`: [3,H,W] on the
// CPU, of the sizes of `truth`. The same bits for any number of threads. Pictures with a side below 11 pixels have no
// SSIM. Throws std::invalid_argument for different sizes, a caller's error.
PhotometricLossSum PhotometricObjective(std::span<const torch::Tensor> rendered, std::span<const TrueView> truth,
                                        const LossConfig& weights);

}  // namespace anchorsplat
