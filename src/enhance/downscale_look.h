#pragma once

#include <array>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/render_mode.h"
#include "core/result.h"
#include "enhance/showing_gaussians.h"
#include "render/rasterizer.h"

namespace anchorsplat {

// Whether what the filter makes of a splat, seen four times closer and averaged down, still shows what the splat showed
// at pixels of a size that is tried, and how much the splat itself changes when it is seen closer. A is the mean of
// alpha over the pictures, c and α what a pixel shows; "low" is the splat at pixels of the size:
//
//   0  ln (A filtered / A low)       1  mean |α filtered − α low| / A low      2  the same of c, over black
//   3  ln (A of the splat / A low)   4  mean |α of the splat − α low| / A low
//
// A splat that was trained at smaller pixels shows the same from closer by; one that was trained at larger ones has
// become thin there.
inline constexpr size_t kDownscaleValues = 5;
using DownscaleLook = std::array<double, kDownscaleValues>;

// Pictures of the middle of a splat, from two sides, in its constant colours.
class DownscaleProbe {
 public:
  // Errors: of OrbitCameras.
  static Result<DownscaleProbe> Make(const TellingGaussians& telling);

  // Pixels of `size`, world units at the middle of the cloud. The same for a cloud that is c times as large, at c times
  // the size. `mode`: kClassic or kAntialiased.
  Result<DownscaleLook> At(double size, RenderMode mode);

 private:
  DownscaleProbe() = default;
  Result<Image> Draw(double pixel, int side, RenderMode mode, const Camera& camera);

  GaussianCloud cloud_;
  Buffer<float> log_scales_;  // of it, unfiltered
  CameraSet cameras_;
  double distance_ = 0;
  Rasterizer rasterizer_;
  RenderOutput output_;
};

}  // namespace anchorsplat
