#pragma once

#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "core/result.h"
#include "tensors/tensor_file.h"
#include "upscale/feature_map.h"

namespace anchorsplat {

// A network's layers. A tile of a picture goes in, and comes out as what a pixel shuffle makes the enlarged tile of.
class UpscaleArchitecture {
 public:
  virtual ~UpscaleArchitecture() = default;

  // Pixels on each side that a pixel hears from.
  virtual int radius() const = 0;
  // Pixels on each side by which a picture is continued with those at its border before it goes in. None: beyond the
  // border are zeros, in every layer.
  virtual int continued() const = 0;
  // Floats of all maps per pixel.
  virtual int64_t floats_per_pixel() const = 0;

  // Multiply-adds per pixel that goes in.
  virtual double multiply_adds_per_pixel() const = 0;

  // `input` [H,W,3]; the result [H,W,3·scale²] is one of `maps`, whose memory is used again.
  virtual const FeatureMap& Run(const FeatureMap& input, std::vector<FeatureMap>& maps) const = 0;
};

// No layer of a file has more channels.
inline constexpr int64_t kMostMapChannels = 1024;

// Of the names in kUpscaleArchitectures. Shapes are checked before anything is allocated. Errors (kBadFile, with the
// path): an architecture that is not known; a tensor that is not there, of another shape, or with values that are not
// finite; a scale that the architecture does not have.
Result<std::unique_ptr<UpscaleArchitecture>> MakeArchitecture(std::string_view name, int scale, const TensorFile& file);
inline constexpr std::string_view kUpscaleArchitectures = "span-1, upconv_7-1 and srmd-1";

// SPAN, "Swift Parameter-free Attention Network" (Wan et al. 2024): tensors conv_1, block_{1…6}.c{1,2,3}_r, conv_2,
// conv_cat and upsampler, each with .weight and .bias, of `channels` that conv_1 says. Its convolutions are the single
// ones that those of training collapse to.
Result<std::unique_ptr<UpscaleArchitecture>> MakeSpan(int scale, const TensorFile& file);

// A chain of 3×3 convolutions with a slope for what is negative, conv.{0…}.weight, .bias and .slope. Of "upconv_7"
// (waifu2x, nagadomi 2016) six, and a transposed convolution up.weight [C,3,4,4], up.bias. Of "srmd" (Zhang et al.
// 2018) eleven, and one more to 3·scale² channels; its first sees behind the colours maps of `constants` [K], which say
// what blur and noise is expected.
Result<std::unique_ptr<UpscaleArchitecture>> MakeUpconv7(int scale, const TensorFile& file);
Result<std::unique_ptr<UpscaleArchitecture>> MakeSrmd(int scale, const TensorFile& file);

}  // namespace anchorsplat
