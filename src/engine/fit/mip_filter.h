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
// camera resolves. Each is convolved with a Gaussian as wide as the pixel of the camera that sees it closest, and keeps
// its integral (core/smoothing_filter.h):
//   s'² = s² + f²,   o' = o·√(Π s²/Π s'²),   f = √0.2 · min over cameras that see it of z/focal.
// What is optimised, grown and pruned are s and o; what is rendered and exported is s' and o'. Constants and rules are
// those of the authors' program (gaussian_model.py: compute_3D_filter, get_scaling_with_3D_filter,
// get_opacity_with_3D_filter).
inline constexpr double kMipVariance = 0.2;  // of the filter, pixels² of that camera

// How such a fit is rendered while it is made and measured: its 2-D filter is 0.1 px², which opacity is compensated for
// (section 5.2; the program's kernel_size): RenderMode::kMip.
RenderOptions MipRendering(RenderOptions render);

// f of every Gaussian: [N] world units, from means [N,3] world. A camera sees a mean beyond `near_plane` (world units
// along z) that lies at most 15 % outside of its picture. Those that none sees get the largest f of the others, or 0.
// Focal lengths are in pixels, the larger of a camera's two. The paper's form, which differs from the program's (least
// z over largest focal length) only where cameras differ.
Buffer<float> MipFilterSizes(std::span<const float> means, std::span<const Camera> cameras, float near_plane);

// The columns that the filter changes. Spaces are those of GaussianCloud; −Inf is legal as a log-scale and gives an
// invisible Gaussian.
struct MipFiltered {
  Buffer<float> log_scales;      // [N,3] ln s'
  Buffer<float> opacity_logits;  // [N] logit o'

  // `sizes` [N] are those of MipFilterSizes. The view borrows this object's columns and the cloud's others.
  CloudView Of(const GaussianCloud& cloud, std::span<const float> sizes);
};

// The gradient of what was rendered of MipFiltered::Of becomes that of `cloud`: ∂L/∂ln s', ∂L/∂logit o' are replaced by
// ∂L/∂ln s, ∂L/∂logit o. Sizes count as constant.
void MipFilterBackward(const GaussianCloud& cloud, std::span<const float> sizes, CloudGradient& gradient);

// Makes the filter a part of the Gaussians, as for a file.
void FuseMipFilter(std::span<const float> sizes, GaussianCloud& cloud);

// Takes opacities down so that o' is at most `opacity`; see CapOpacities.
void CapFilteredOpacities(std::span<const float> sizes, double opacity, GaussianCloud& cloud);

}  // namespace anchorsplat
