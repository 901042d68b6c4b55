#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/image.h"
#include "core/result.h"
#include "upscale/architecture.h"

namespace anchorsplat {

// What a file says of its network, in the metadata of its safetensors. `source` and `licence` are for people and may be
// any text.
struct UpscalerInfo {
  std::string architecture;  // with its version, "span-1"
  int scale = 0;             // 2 to 4
  std::string source;
  std::string licence;
};

// A network that enlarges pictures: a small convolutional network that was trained on pictures. What it adds is
// invented.
//
// Colours go in as an Image has them, sRGB from 0 to 1, (colour − input.mean)·input.scale in the first layer's terms.
// Large pictures go through in tiles, which overlap by all that a pixel hears from: the result has the same bits as in
// one piece, and for any number of threads. With another SIMD width the last places may differ.
class Upscaler {
 public:
  // Errors: those of TensorFile; kBadFile with the path: no upscaler, another version of its format, an architecture,
  // colour space or range that is not known, and what MakeArchitecture says.
  static Result<Upscaler> Read(const std::filesystem::path& path);

  const UpscalerInfo& info() const { return info_; }
  double multiply_adds_per_pixel() const { return architecture_->multiply_adds_per_pixel(); }  // of the input

  // [3,H,W] to [3,H·scale,W·scale], not clamped. `tile`: the side of a tile in pixels of the input; 0: what takes a
  // quarter of a gigabyte. One call at a time. Errors: kBadArgument: no colour picture, or a result that is too large;
  // kBadFile: the network's numbers overflow.
  Result<Image> Enlarge(const Image& image, int tile = 0);

 private:
  Upscaler() = default;
  // The picture's pixels of `box`, which may reach beyond it, in the first layer's terms.
  void Load(const Image& image, const PixelBox& box);

  UpscalerInfo info_;
  std::string path_;
  float mean_[3] = {};
  float input_scale_ = 1;
  std::unique_ptr<UpscaleArchitecture> architecture_;
  FeatureMap input_;
  std::vector<FeatureMap> maps_;
};

// The value of "format" in the metadata.
inline constexpr const char* kUpscalerFormat = "anchorsplat-upscaler-1";

}  // namespace anchorsplat
