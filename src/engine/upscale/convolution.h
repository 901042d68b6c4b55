#pragma once

#include <cstdint>
#include <span>

#include "model/kernels/packed_weights.h"
#include "upscale/feature_map.h"

namespace anchorsplat {

// The weights of a convolution over pixels in the kernel's order, from `weights` [outputs, inputs, side, side] and
// `bias` [outputs] as PyTorch's Conv2d has them. A row of a 3×3 kernel is one tap whose inputs are those of three
// pixels.
PackedWeights PackConvolution(const float* weights, const float* bias, int64_t outputs, int64_t inputs, int64_t side);

// The same of a transposed convolution 4×4 with stride 2 which cuts a pixel of each side off what it makes (PyTorch's
// ConvTranspose2d(4, stride=2, padding=1)): `weights` [inputs, outputs, 4, 4]. Each of the four pixels that it makes of
// one sees 2×2 of its 3×3 neighbours, so this is a 3×3 convolution to 4·outputs channels, output·4 + 2·row + column,
// and a pixel shuffle behind it (pixel_shuffle.h).
PackedWeights PackTransposedConvolution(const float* weights, const float* bias, int64_t outputs, int64_t inputs);

enum class MapActivation : uint8_t {
  kNone,
  kSlope,  // x < 0: x·slope of its channel. ReLU (0), leaky ReLU (the same for all) and PReLU
  kSilu,   // x·σ(x)
  kGate,   // (x + gated)·(σ(x) − 1/2): SPAN's attention without parameters (Wan et al. 2024, eq. 5)
};

// A map and the weights that it is seen through, of PackConvolution: 1 or 3 taps.
struct ConvolutionInput {
  const FeatureMap* map;
  const PackedWeights* weights;
};

// out = activation(b + Σ_i conv(input_i)), all maps of one size. Several inputs are the convolution of their
// concatenation, which need not be made. The sum runs over inputs, rows of the kernel, columns and channels in this
// order; the bias is that of the first input.
struct ConvolutionParams {
  std::span<const ConvolutionInput> inputs;
  MapActivation activation = MapActivation::kNone;
  const float* slopes = nullptr;      // [outputs], of kSlope
  const FeatureMap* gated = nullptr;  // of kGate, [H,W,outputs]
  // out
  FeatureMap* out;  // [H,W,outputs], of this shape already; none of the inputs nor `gated`
};
// The same bits for any number of threads, and for a pixel wherever it stands in its map; with another SIMD width they
// may differ in the last place.
void ConvolutionCpu(const ConvolutionParams& p);

}  // namespace anchorsplat
