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

class StillCloud;

struct RenderOptions {
  RasterProfile profile = RasterProfile::kGsplat14;
  RenderMode mode = RenderMode::kClassic;
  std::array<float, 3> background = {0, 0, 0};
  float near_plane = kNear;                      // world units along z
  float far_plane = kFar;                        // world units along z
  std::optional<float> dilation = std::nullopt;  // px²; the mode's own otherwise
  // What is shown: no near plane lies farther than kNearShare of the distance to it (NearPlane in
  // render/shown_range.h). Fits have none and draw what gsplat does.
  std::optional<Framing> subject = std::nullopt;
  // A mode that compensates keeps the integral that a Gaussian has with this much dilation instead of `dilation`: its
  // opacity becomes o·sqrt(det(Σ₂ + compensated_from·I) / det(Σ₂ + dilation·I)). 0 is the modes' own rule. Otherwise
  // the picture shows what larger pixels would average of one with the smaller dilation, as far as every Gaussian for
  // itself is concerned.
  float compensated_from = 0;    // px², 0 to `dilation`
  int sh_degree = kMaxShDegree;  // highest degree used; the cloud's own if that is lower
  bool depth = false;            // fill RenderOutput::depth too
  // Cut-offs of blending. Other values than the defaults are for tests: no cut-offs make the picture smooth.
  float min_alpha = kMinAlpha;                  // in (0, 1)
  float min_transmittance = kMinTransmittance;  // in [0, 1)
  // (tile, Gaussian) pairs listed at once, 4 bytes each, 1 to 2^31; when there are more, the picture is made in several
  // runs of tiles, without a difference in its pixels. Every run holds at least one tile, that is at most N pairs.
  int64_t max_pairs = kMaxPairs;
  bool gradient = false;  // keep what Backward needs of this picture: 8 bytes per pixel and Gaussian more
  bool absgrad = false;   // Backward fills CloudGradient::means2d_abs, too (gsplat's name for it)
};

inline float DilationOf(const RenderOptions& options) { return options.dilation.value_or(DilationOf(options.mode)); }

struct RenderOutput {
  Image color;  // [3,H,W], not clamped above 1, background included
  Image alpha;  // [1,H,W] 1 − T
  Image depth;  // [1,H,W] expected camera z: Σ α·T·z / alpha; 0 where alpha is 0. Empty unless asked for
};

// ∂L/∂ of what Render put out; L is any number made of it.
struct RenderGradient {
  Image color;   // [3,H,W]
  Image alpha;   // [1,H,W]; empty = 0
  PixelBox box;  // nothing outside is read and it counts as 0. A loss that compares an object on a plain background
                 // is flat on most of the picture
};

// ∂L/∂ of every stored value of the cloud: exp, sigmoid and the quaternion's normalisation are included. Gaussians that
// were culled or skipped have 0. Row i belongs to Gaussian i.
struct CloudGradient {
  Buffer<float> means;           // [N,3] per world unit
  Buffer<float> log_scales;      // [N,3]
  Buffer<float> quats;           // [N,4] of the quaternion as stored: orthogonal to it; 0 for the zero quaternion
  Buffer<float> opacity_logits;  // [N]
  Buffer<float> sh;              // [N,K,3] as the cloud's; 0 for coefficients above the degree in use. Empty where
                                 // they took a step instead

  // What densification asks for.
  Buffer<float> means2d;  // [N,2] ∂L/∂(mean in the picture), per pixel
  // [N,2] the same, but the absolute values of what every pixel contributes are added up (Ye et al. 2024, AbsGS). Empty
  // unless RenderOptions::absgrad asks for it.
  Buffer<float> means2d_abs;
  Buffer<int32_t> radii;  // [N,2] pixels, as the profile defines them; 0 = culled by its rules

  std::array<float, 3> background{};
};

// ∂L/∂ of what pixels see of a Gaussian: its opacity and its colour, not the shape and the place behind them. Row i
// belongs to Gaussian i.
struct SeenGradient {
  // o·∂L/∂o; of a compensated opacity, too. 0 where no pixel adds it.
  float OfLogOpacity(int64_t i) const { return sums[static_cast<size_t>(i)].q; }
  // ∂L/∂rgb; 0 where the colour is clamped at 0.
  float OfColor(int64_t i, size_t channel) const {
    const float sum = sums[static_cast<size_t>(i)].rgb[channel];
    return sum != 0 && projected[static_cast<size_t>(i)].rgb[channel] > 0 ? sum : 0;
  }

  std::span<const BlendGradient> sums;           // [N]
  std::span<const ProjectedGaussian> projected;  // [N]; of culled ones anything
  std::span<const int32_t> radii;                // [N,2] as of CloudGradient
};

// What the last picture took; the backward stages are those of the last Backward. A GPU does all stages while the host
// waits: there `blend` is the whole wait, the other stages and `evaluations` are 0.
struct RenderStatistics {
  double project = 0, spherical_harmonics = 0, sort = 0, bin = 0, blend = 0;  // seconds on the clock, per stage
  double blend_backward = 0, project_backward = 0;                            // the latter with the spherical harmonics
  int64_t visible = 0;                                                        // Gaussians that were not culled
  int64_t pairs = 0;                                                          // (tile, Gaussian)
  int64_t evaluations = 0;  // (4×4-pixel block, Gaussian); fewer than would be possible where pixels are opaque
  int runs = 0;             // of tiles, see RenderOptions::max_pairs
};

// Whether Render would take the camera and the options: its errors but for those that are about the cloud or memory.
Status ValidateRender(const Camera& camera, const RenderOptions& options);

// The 3DGS rasterizer (Kerbl et al. 2023), on the device of the run (RunContext::device in core/run_context.h). The CPU
// is the reference. A GPU follows its arithmetic: the same order of depths, and the same picture to 1e-4 but where a
// pixel lies right on a cut-off (min_alpha, min_transmittance). A picture that the GPU's floats cannot hold, and
// everything after a failure of the GPU, is made on the CPU; the caller need not know. Keeps its buffers, so one object
// per thread of control renders many views without allocating: 100 bytes per Gaussian and 4 per pair listed at once.
// The result is bit-identical for every number of threads.
//
// Two things follow gsplat in spirit rather than to the letter. Coordinates are calculated in double, and the
// determinant of a covariance as a sum of squares: gsplat's difference in floats leaves a long thin Gaussian three or
// four digits. The zero quaternion is the identity (core/rotation.h), where gsplat divides by zero.
class Rasterizer {
 public:
  Rasterizer();
  ~Rasterizer();
  Rasterizer(Rasterizer&&) noexcept;
  Rasterizer& operator=(Rasterizer&&) noexcept;

  // Errors (kBadArgument): an invalid cloud or one of 2^31 Gaussians or more; a camera without pixels, with more than
  // 2^19 per side, with a focal length that is not positive and finite, or with another value that is not finite; a
  // near plane that is not positive or not before the far one; options out of their range; not enough memory for the
  // picture. Gaussians that are not usable (core/gaussian_cloud.h) are skipped, as far as the picture needs the value:
  // SH coefficients of a degree that is not used are not looked at. −Inf is legal as a log-scale (a flat Gaussian),
  // ±Inf as an opacity logit.
  Status Render(const CloudView& cloud, const Camera& camera, const RenderOptions& options, RenderOutput& output);
  // The same of one that does not change (render/still_cloud.h), so that a GPU need not be given it again.
  Status Render(StillCloud& cloud, const Camera& camera, const RenderOptions& options, RenderOutput& output);

  // A picture by each camera, with the bits that Render gives it. They are given to `use` in turn, with the place of
  // the camera; statistics() are then of that picture, and `use` may take it away. A GPU draws several before the host
  // waits for them, where they are small. No gradient of them can be asked for. Errors: of Render and of `use`, after
  // which no more are drawn.
  Status RenderEach(StillCloud& cloud, std::span<const Camera> cameras, const RenderOptions& options,
                    const std::function<Status(size_t, RenderOutput&)>& use);

  // The gradient of the last Render, which must have been asked to keep what this needs (RenderOptions::gradient), with
  // the same values in `cloud`. Exact for what Render calculates: cut-offs and the order of depths count as constant,
  // as do radii and tiles; where α is capped at 0.999 nothing flows to it, where a colour is clamped at 0 nothing flows
  // to its coefficients, and where the Jacobian's x/z (y/z) is clamped it does not depend on x (y). `depth` has no
  // gradient. A gradient that is not finite spoils the Gaussians under its pixel, no others. The result is
  // bit-identical for every number of threads.
  //
  // Errors (kBadArgument): no such Render before; a cloud of another size or degree; gradients of another size than the
  // picture; a box that reaches outside of it; not enough memory (kIo).
  //
  // With a `step` the coefficients of the spherical harmonics take it right away, and CloudGradient::sh stays empty:
  // written down, it would be the largest part of what a fit moves through memory. The values are those of a gradient
  // that is written down and followed by the same step of Adam, bit by bit.
  Status Backward(const CloudView& cloud, const RenderGradient& output_gradient, CloudGradient& gradient,
                  const CoefficientStep* step = nullptr);
  Status Backward(StillCloud& cloud, const RenderGradient& output_gradient, CloudGradient& gradient);

  // The same as far as blending goes, which is a part of Backward's time and, on the CPU, takes no memory of its own.
  // The spans are valid until the next call. Errors: of Backward.
  Result<SeenGradient> BackwardToSeen(const CloudView& cloud, const RenderGradient& output_gradient);

  const RenderStatistics& statistics() const;  // of the last Render that succeeded

 private:
  struct Subject;
  struct State;
  Status RenderSubject(const Subject& subject, const Camera& camera, const RenderOptions& options,
                       RenderOutput& output);
  Status BackwardOfSubject(const Subject& subject, const RenderGradient& output_gradient, CloudGradient& gradient,
                           const CoefficientStep* step);
  std::unique_ptr<State> state_;
};

}  // namespace anchorsplat
