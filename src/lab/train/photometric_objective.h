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

// What a rendered view should look like.
struct TrueView {
  Image picture;                      // [3,H,W], over the background
  std::array<float, 3> background{};  // that the render has, too
  PixelBox object;                    // of pixels that differ from the background; empty: none does
  PixelBox perceptual;                // what LPIPS looks at; empty: nothing
  Buffer<uint8_t> ignored;  // [H,W] not 0: the picture says nothing there; empty: it says something everywhere
};

// The terms of one view, for people. With d = min(render, 1) − truth, W·H pixels of three channels, and F the
// foreground: pixels where the truth differs from its background by more than 0.004 (one step of 8 bits) in a channel
// or the render differs from it at all,
//   l1      Σ|d| / F                        three channels together, as AnchorSplat's release counts it
//   ssim    Σ(1 − SSIM) / 3F                over windows that lie inside the picture
//   mse     Σd² / 3F
//   log_mse ln(Σd² / 3WH + 1e-7)            PSNR up to a factor, so every view counts alike however hard it is
// A mean over the foreground does not depend on how much empty space is around an object. Views without foreground are
// left out.
struct PhotometricTerms {
  double total = 0;
  double l1 = 0, ssim = 0, mse = 0, log_mse = 0;
  double psnr = 0;         // dB, of the whole picture
  int64_t foreground = 0;  // F
};

struct PhotometricLossSum {
  torch::Tensor loss;                   // the mean of `total` over the views with foreground; 0 when there are none
  std::vector<PhotometricTerms> terms;  // per view
};

// The weighted sum of the terms and, in the same pass, its gradient; one view per thread. `rendered` are [3,H,W] on the
// CPU, of the sizes of `truth`. The same bits for any number of threads. Pictures with a side below 11 pixels have no
// SSIM. Throws std::invalid_argument when sizes differ: an error of the caller.
PhotometricLossSum PhotometricObjective(std::span<const torch::Tensor> rendered, std::span<const TrueView> truth,
                                        const LossConfig& weights);

}  // namespace anchorsplat
