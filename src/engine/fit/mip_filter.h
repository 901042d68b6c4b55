#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/buffer.h"
#include "core/camera.h"
#include "core/cloud_view.h"
#include "core/gaussian_cloud.h"
#include "render/rasterizer.h"

namespace anchorsplat {

// Mip-Splatting's 3-D smoothing filter (Yu et al. 2024, section 5.1): no Gaussian may hold detail that no training
// camera resolves. Each is convolved with a Gaussian as wide as a pixel of the closest camera that sees it, keeping its
// integral (core/smoothing_filter.h):
//   s'² = s² + f²,   o' = o·√(Π s²/Π s'²),   f = √0.2 · min over cameras that see it of z/focal.
// Optimisation, growth and pruning use s and o; rendering and export use s' and o'. Constants and rules are those of
// the authors' program (gaussian_model.py: compute_3D_filter, get_scaling_with_3D_filter, get_opacity_with_3D_filter).
inline constexpr double kMipVariance = 0.2;  // of the filter, pixels² of that camera

// Rendering during such a fit and its evaluation: a 2-D filter of 0.1 px², compensated by opacity (section 5.2; the
// program's kernel_size): RenderMode::kMip.
RenderOptions MipRendering(RenderOptions render);

// f of every Gaussian [N], world units, from means [N,3] world. A camera sees a mean beyond `near_plane` (world units
// along z) that projects at most 15 % outside its picture. Means that no camera sees get the largest f of the others,
// or 0. Uses the larger focal length of a camera, pixels. This is the paper's formula; the program's (least z over
// largest focal length) differs only if cameras differ.
Buffer<float> MipFilterSizes(std::span<const float> means, std::span<const Camera> cameras, float near_plane);

// The columns the filter changes, in GaussianCloud's spaces. A log-scale of −Inf is legal and gives an invisible
// Gaussian.
struct MipFiltered {
  Buffer<float> log_scales;      // [N,3] ln s'
  Buffer<float> opacity_logits;  // [N] logit o'

  // `sizes` [N]: MipFilterSizes. The view borrows this object's columns and the cloud's others.
  CloudView Of(const GaussianCloud& cloud, std::span<const float> sizes);
};

// Converts the gradient of what MipFiltered::Of rendered to that of `cloud`: replaces ∂L/∂ln s', ∂L/∂logit o' by ∂L/∂ln
// s, ∂L/∂logit o. Sizes count as constant.
void MipFilterBackward(const GaussianCloud& cloud, std::span<const float> sizes, CloudGradient& gradient);

// Fuses the filter into the Gaussians, as for a file.
void FuseMipFilter(std::span<const float> sizes, GaussianCloud& cloud);

// Limits opacities so that o' is at most `opacity`; see CapOpacities.
void CapFilteredOpacities(std::span<const float> sizes, double opacity, GaussianCloud& cloud);

}  // namespace anchorsplat
