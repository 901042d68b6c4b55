#pragma once

#include <array>
#include <memory>

#include "core/camera.h"
#include "core/gaussian_cloud.h"
#include "core/image.h"
#include "core/result.h"
#include "render/constants.h"

namespace anchorsplat {

// Which pixels a Gaussian may touch (docs/method.md): classic rasterizers disagree beyond three sigma.
enum class RasterProfile {
  kGsplat14,  // gsplat 1.0–1.4: square of ceil(3σ_max) pixels, rounded out to 16-px tiles (default)
  kGsplat15,  // gsplat 1.5: per axis min(3.33, sqrt(2 ln(255·opacity)))·σ, rounded out to 16-px tiles
};

struct RenderOptions {
  RasterProfile profile = RasterProfile::kGsplat14;
  RenderMode mode = RenderMode::kClassic;
  std::array<float, 3> background = {0, 0, 0};
  float near_plane = kNear;
  float far_plane = kFar;
  float dilation = kDilation;    // px²
  int sh_degree = kMaxShDegree;  // highest degree used; the cloud's own if that is lower
  bool depth = false;            // fill RenderOutput::depth too
};

struct RenderOutput {
  Image color;  // [3,H,W], not clamped above 1, background included
  Image alpha;  // [1,H,W] 1 − T
  Image depth;  // [1,H,W] expected camera z: Σ α·T·z / alpha; 0 where alpha is 0. Empty unless asked for
};

// The 3DGS rasterizer on the CPU. Keeps its buffers, so one object per thread of control renders many views without
// allocating. The result is bit-identical for every number of threads.
class Rasterizer {
 public:
  Rasterizer();
  ~Rasterizer();
  Rasterizer(Rasterizer&&) noexcept;
  Rasterizer& operator=(Rasterizer&&) noexcept;

  // Errors (kBadArgument): an invalid cloud, a camera without pixels or with a focal length that is not positive and
  // finite. Gaussians with a value that is not finite are skipped.
  Status Render(const GaussianCloud& cloud, const Camera& camera, const RenderOptions& options, RenderOutput& output);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace anchorsplat
