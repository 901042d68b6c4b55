#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/image.h"
#include "core/result.h"
#include "upscale/architecture.h"

namespace anchorsplat {

// Metadata of a network's safetensors file. `source` and `licence` are free text for people.
struct UpscalerInfo {
  std::string architecture;  // with its version, "span-1"
  int scale = 0;             // 2 to 4
  std::string source;
  std::string licence;
};

// A small convolutional network that enlarges pictures. The detail it adds is invented.
//
// Input colours are sRGB 0–1 as in Image; the first layer gets (colour − input.mean)·input.scale. Large pictures are
// processed in tiles that overlap by the receptive field: the bits are those of a single piece, for any number of
// threads. The last bit may differ between SIMD widths.
class Upscaler {
 public:
  // Errors: those of TensorFile; kBadFile with the path: no upscaler; another format version; an unknown architecture,
  // colour space or range; those of MakeArchitecture.
  static Result<Upscaler> Read(const std::filesystem::path& path);

  const UpscalerInfo& info() const { return info_; }
  double multiply_adds_per_pixel() const { return architecture_->multiply_adds_per_pixel(); }  // per input pixel

  // Enlarges [3,H,W] to [3,H·scale,W·scale], not clamped. `tile`: tile side in input pixels; 0: about a quarter of a
  // gigabyte per tile. Not thread-safe. Errors: kBadArgument: not three channels, or a result that is too large;
  // kBadFile:
  // activations overflow.
  Result<Image> Enlarge(const Image& image, int tile = 0);

 private:
  Upscaler() = default;
  // Loads the picture's pixels in `box`, which may reach beyond it, as the first layer's input.
  void Load(const Image& image, const PixelBox& box);

  UpscalerInfo info_;
  std::string path_;
  float mean_[3] = {};
  float input_scale_ = 1;
  std::unique_ptr<UpscaleArchitecture> architecture_;
  FeatureMap input_;
  std::vector<FeatureMap> maps_;
};

// Value of "format" in the metadata.
inline constexpr const char* kUpscalerFormat = "anchorsplat-upscaler-1";

}  // namespace anchorsplat
