#pragma once

#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "core/result.h"
#include "tensors/tensor_file.h"
#include "upscale/feature_map.h"

namespace anchorsplat {

// Layers of a network: map a tile of a picture to the input of the pixel shuffle that forms the enlarged tile.
class UpscaleArchitecture {
 public:
  virtual ~UpscaleArchitecture() = default;

  // Receptive field: pixels on each side that influence a pixel.
  virtual int radius() const = 0;
  // Pixels by which the picture is extended on each side, repeating its border. 0: zero padding in every layer.
  virtual int continued() const = 0;
  // Floats of all feature maps per pixel.
  virtual int64_t floats_per_pixel() const = 0;

  // Multiply-adds per input pixel.
  virtual double multiply_adds_per_pixel() const = 0;

  // `input` [H,W,3]. Returns [H,W,3·scale²], one of `maps`, whose memory is reused.
  virtual const FeatureMap& Run(const FeatureMap& input, std::vector<FeatureMap>& maps) const = 0;
};

// Maximum channels of a layer.
inline constexpr int64_t kMostMapChannels = 1024;

// Loads one of kUpscaleArchitectures. Checks shapes before allocating. Errors (kBadFile, with the path): an unknown
// architecture; a tensor missing, of the wrong shape, or with non-finite values; a scale the architecture lacks.
Result<std::unique_ptr<UpscaleArchitecture>> MakeArchitecture(std::string_view name, int scale, const TensorFile& file);
inline constexpr std::string_view kUpscaleArchitectures = "span-1, upconv_7-1 and srmd-1";

// SPAN, "Swift Parameter-free Attention Network" (Wan et al. 2024). Tensors: conv_1, block_{1…6}.c{1,2,3}_r, conv_2,
// conv_cat and upsampler, each with .weight and .bias; conv_1 determines the number of channels. Convolutions are the
// single ones to which training's collapse.
Result<std::unique_ptr<UpscaleArchitecture>> MakeSpan(int scale, const TensorFile& file);

// Chains of 3×3 convolutions with a slope for negative values: conv.{0…}.weight, .bias and .slope.
// "upconv_7" (waifu2x, nagadomi 2016): six, then a transposed convolution up.weight [C,3,4,4], up.bias.
// "srmd" (Zhang et al. 2018): eleven, then one to 3·scale² channels. Its first also reads constant maps `constants`
// [K], which state the expected blur and noise.
Result<std::unique_ptr<UpscaleArchitecture>> MakeUpconv7(int scale, const TensorFile& file);
Result<std::unique_ptr<UpscaleArchitecture>> MakeSrmd(int scale, const TensorFile& file);

}  // namespace anchorsplat
