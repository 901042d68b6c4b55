#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>

#include "core/camera.h"
#include "core/cloud_view.h"
#include "core/framing.h"
#include "core/gaussian_cloud.h"
#include "core/image.h"
#include "core/result.h"
#include "render/adam_runs.h"
#include "render/blend_backward.h"
#include "render/constants.h"
#include "render/profile.h"
#include "render/projected_gaussian.h"

namespace anchorsplat {

class ConstantCloud;

struct RenderOptions {
  RasterProfile profile = RasterProfile::kGsplat14;
  RenderMode mode = RenderMode::kClassic;
  std::array<float, 3> background = {0, 0, 0};
  float near_plane = kNear;                      // world units along z
  float far_plane = kFar;                        // world units along z
  std::optional<float> dilation = std::nullopt;  // px²; default: the mode's
  // The displayed splat. The near plane is at most kNearShare of the distance to it (NearPlane in
  // render/shown_range.h). Unset in fits, which draw what gsplat does.
  std::optional<Framing> subject = std::nullopt;
  // A compensating mode preserves the integral that a Gaussian has with this dilation instead of `dilation`: its
  // opacity becomes o·sqrt(det(Σ₂ + compensated_from·I) / det(Σ₂ + dilation·I)). 0 is the modes' own rule. Other values
  // approximate, per Gaussian, the average of a picture with the smaller dilation over larger pixels.
  float compensated_from = 0;    // px², 0 to `dilation`
  int sh_degree = kMaxShDegree;  // highest degree used, limited by the cloud's
  bool depth = false;            // fill RenderOutput::depth
  // Cut-offs of blending. Only tests change them: without cut-offs the picture is smooth.
  float min_alpha = kMinAlpha;                  // in (0, 1)
  float min_transmittance = kMinTransmittance;  // in [0, 1)
  // Maximum (tile, Gaussian) pairs listed at once, 4 bytes each, 1 to 2^31. With more, the picture is drawn in several
  // runs of tiles, with identical pixels. A run has at least one tile, with up to N pairs.
  int64_t max_pairs = kMaxPairs;
  bool gradient = false;  // keep data for Backward: 8 bytes more per pixel and Gaussian
  bool absgrad = false;   // Backward fills CloudGradient::means2d_abs (gsplat's term)
};

inline float DilationOf(const RenderOptions& options) { return options.dilation.value_or(DilationOf(options.mode)); }

struct RenderOutput {
  Image color;  // [3,H,W], not clamped above 1, including background
  Image alpha;  // [1,H,W] 1 − T
  Image depth;  // [1,H,W] expected camera z: Σ α·T·z / alpha; 0 if alpha is 0. Empty unless requested
};

// ∂L/∂ of Render's output, for a scalar L.
struct RenderGradient {
  Image color;   // [3,H,W]
  Image alpha;   // [1,H,W]; empty = 0
  PixelBox box;  // gradients outside count as 0 and are not read, as for losses that are flat around an object
};

// ∂L/∂ of every stored value of the cloud, through exp, sigmoid and quaternion normalisation. 0 for Gaussians that were
// culled or skipped. Row i belongs to Gaussian i.
struct CloudGradient {
  Buffer<float> means;           // [N,3] per world unit
  Buffer<float> log_scales;      // [N,3]
  Buffer<float> quats;           // [N,4] for stored quaternions: orthogonal to them; 0 for the zero quaternion
  Buffer<float> opacity_logits;  // [N]
  // [N,K,3] as in the cloud; 0 above the degree in use. Empty if a step was taken instead
  Buffer<float> sh;

  // For densification.
  Buffer<float> means2d;  // [N,2] ∂L/∂(2-D mean), per pixel
  // [N,2] the same with absolute values of each pixel's contribution (Ye et al. 2024, AbsGS). Empty without
  // RenderOptions::absgrad.
  Buffer<float> means2d_abs;
  Buffer<int32_t> radii;  // [N,2] pixels, as the profile defines them; 0 = culled by its rules

  std::array<float, 3> background{};
};

// ∂L/∂ opacity and colour of Gaussians, without their shape and position. Row i belongs to Gaussian i.
struct AppearanceGradient {
  // o·∂L/∂o, for the compensated opacity if there is one. 0 if no pixel adds the Gaussian.
  float OfLogOpacity(int64_t i) const { return sums[static_cast<size_t>(i)].q; }
  // ∂L/∂rgb; 0 if the colour is clamped at 0.
  float OfColor(int64_t i, size_t channel) const {
    const float sum = sums[static_cast<size_t>(i)].rgb[channel];
    return sum != 0 && projected[static_cast<size_t>(i)].rgb[channel] > 0 ? sum : 0;
  }

  std::span<const BlendGradient> sums;           // [N]
  std::span<const ProjectedGaussian> projected;  // [N]; undefined if culled
  std::span<const int32_t> radii;                // [N,2] as in CloudGradient
};

// Costs of the last picture; backward stages are those of the last Backward. A GPU does all stages while the host
// waits: `blend` is then the whole wait, and other stages and `evaluations` are 0.
struct RenderStatistics {
  double project = 0, spherical_harmonics = 0, sort = 0, bin = 0, blend = 0;  // wall-clock seconds per stage
  double blend_backward = 0, project_backward = 0;                            // the latter including SH
  int64_t visible = 0;                                                        // Gaussians not culled
  int64_t pairs = 0;                                                          // (tile, Gaussian)
  int64_t evaluations = 0;  // (4×4-pixel block, Gaussian); opaque pixels save some
  int runs = 0;             // runs of tiles, see RenderOptions::max_pairs
};

// Validates camera and options: the errors of Render except those about the cloud and memory.
Status ValidateRender(const Camera& camera, const RenderOptions& options);

// The 3DGS rasterizer (Kerbl et al. 2023), on the device of the run (RunContext::device in core/run_context.h). The CPU
// is the reference. A GPU uses the same arithmetic and depth order, and its picture agrees to 1e-4 except for pixels
// right at a cut-off (min_alpha, min_transmittance). Pictures beyond the GPU's float range, and everything after a GPU
// failure, fall back to the CPU transparently. Keeps its buffers (100 bytes per Gaussian and 4 per pair listed at
// once), so one object per controlling thread renders many views without allocation. Bit-identical for any number of
// threads.
//
// Two deviations from gsplat: coordinates are computed in double, and a covariance's determinant as a sum of squares,
// where gsplat's float difference leaves long thin Gaussians only three or four digits. The zero quaternion is the
// identity (core/rotation.h), where gsplat divides by zero.
class Rasterizer {
 public:
  Rasterizer();
  ~Rasterizer();
  Rasterizer(Rasterizer&&) noexcept;
  Rasterizer& operator=(Rasterizer&&) noexcept;

  // Renders `cloud`. Errors (kBadArgument): an invalid cloud or one with 2^31 Gaussians or more; a camera without
  // pixels, above 2^19 per side, with a non-positive or non-finite focal length or another non-finite value; a near
  // plane that is not positive or not before the far plane; options out of range; not enough memory for the picture.
  // Unusable Gaussians (core/gaussian_cloud.h) are skipped, considering only values that are used: SH of unused degrees
  // are not read. Legal infinities: log-scale −Inf (a flat Gaussian), opacity logit ±Inf.
  Status Render(const CloudView& cloud, const Camera& camera, const RenderOptions& options, RenderOutput& output);
  // The same for a constant cloud (render/constant_cloud.h), which a GPU receives only once.
  Status Render(ConstantCloud& cloud, const Camera& camera, const RenderOptions& options, RenderOutput& output);

  // Renders a picture per camera, bit-identical to Render. `use` receives them in order with the camera's index, may
  // move the picture away, and sees its statistics(). A GPU draws several small ones before the host waits. Without
  // gradients. Errors: those of Render and `use`, which end the loop.
  Status RenderEach(ConstantCloud& cloud, std::span<const Camera> cameras, const RenderOptions& options,
                    const std::function<Status(size_t, RenderOutput&)>& use);

  // Gradient of the last Render, which must have had RenderOptions::gradient, with the same values in `cloud`. Exact
  // for Render's computation, with cut-offs, depth order, radii and tiles constant: α capped at 0.999 and colours
  // clamped at 0 pass no gradient, and a clamped x/z (y/z) of the Jacobian does not depend on x (y). `depth` has no
  // gradient. A non-finite gradient affects only Gaussians under its pixel. Bit-identical for any number of threads.
  //
  // Errors (kBadArgument): no such Render before; a cloud of another size or degree; gradients of another size than the
  // picture; a box beyond the picture; not enough memory (kIo).
  //
  // With `step`, SH coefficients take an Adam step immediately and CloudGradient::sh stays empty, as storing it would
  // be most of a fit's memory traffic. Results are bit-identical to storing the gradient and applying the step.
  Status Backward(const CloudView& cloud, const RenderGradient& output_gradient, CloudGradient& gradient,
                  const CoefficientStep* step = nullptr);
  Status Backward(ConstantCloud& cloud, const RenderGradient& output_gradient, CloudGradient& gradient);

  // The backward pass of blending only, which is faster and, on the CPU, needs no extra memory. The spans are valid
  // until the next call. Errors: those of Backward.
  Result<AppearanceGradient> BackwardToAppearance(const CloudView& cloud, const RenderGradient& output_gradient);

  const RenderStatistics& statistics() const;  // of the last successful Render

 private:
  struct Source;
  struct State;
  Status RenderSource(const Source& source, const Camera& camera, const RenderOptions& options, RenderOutput& output);
  Status BackwardOfSource(const Source& source, const RenderGradient& output_gradient, CloudGradient& gradient,
                          const CoefficientStep* step);
  std::unique_ptr<State> state_;
};

}  // namespace anchorsplat
