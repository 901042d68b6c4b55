#pragma once

#include <cstdint>
#include <span>

#include "kernels/packed_weights.h"
#include "upscale/feature_map.h"

namespace anchorsplat {

// Packs weights of a 2-D convolution: `weights` [outputs, inputs, side, side] and `bias` [outputs] as in PyTorch's
// Conv2d. Each row of a 3×3 kernel becomes one tap with the inputs of three pixels.
PackedWeights PackConvolution(const float* weights, const float* bias, int64_t outputs, int64_t inputs, int64_t side);

// The same for a transposed convolution, PyTorch's ConvTranspose2d(4, stride=2, padding=1): `weights` [inputs, outputs,
// 4, 4]. Each of the four output pixels per input pixel depends on 2×2 of its 3×3 neighbours. So it is a 3×3
// convolution to 4·outputs channels, output·4 + 2·row + column, followed by a pixel shuffle (pixel_shuffle.h).
PackedWeights PackTransposedConvolution(const float* weights, const float* bias, int64_t outputs, int64_t inputs);

enum class MapActivation : uint8_t {
  kNone,
  kSlope,  // x < 0: x·slope of the channel. ReLU (0), leaky ReLU (equal slopes) and PReLU
  kSilu,   // x·σ(x)
  kGate,   // (x + gated)·(σ(x) − 1/2): SPAN's parameter-free attention (Wan et al. 2024, eq. 5)
};

// A feature map and its weights, from PackConvolution: 1 or 3 taps.
struct ConvolutionInput {
  const FeatureMap* map;
  const PackedWeights* weights;
};

// out = activation(b + Σ_i conv(input_i)), all maps of one size. Several inputs act as their concatenation. Sums run
// over inputs, kernel rows, columns and channels in this order. The bias is the first input's.
struct ConvolutionParams {
  std::span<const ConvolutionInput> inputs;
  MapActivation activation = MapActivation::kNone;
  const float* slopes = nullptr;      // [outputs], for kSlope
  const FeatureMap* gated = nullptr;  // [H,W,outputs], for kGate
  // out
  FeatureMap* out;  // [H,W,outputs], already of this shape; not an input nor `gated`
};
// The same bits for any number of threads and at any place in a map; the last bit may differ between SIMD widths.
void ConvolutionCpu(const ConvolutionParams& p);

}  // namespace anchorsplat
