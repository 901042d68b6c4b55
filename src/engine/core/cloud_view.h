#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "core/gaussian_cloud.h"
#include "core/result.h"

namespace anchorsplat {

// Borrowed columns of a splat: of a GaussianCloud, or arrays of a program that uses the library. Shapes, spaces and
// names are those of GaussianCloud. Valid as long as the arrays are. Read-only code takes this type so that no caller
// has to copy.
struct CloudView {
  int sh_degree = 0;                      // 0–3
  std::span<const float> means;           // [N,3] relative to `origin`
  std::span<const float> log_scales;      // [N,3]
  std::span<const float> quats;           // [N,4]
  std::span<const float> opacity_logits;  // [N]
  std::span<const float> sh;              // [N,(sh_degree+1)²,3]

  std::optional<RenderMode> render_mode;
  std::span<const std::string> comments;
  WorldOrigin origin = {0, 0, 0};
  bool double_means = false;

  CloudView() = default;
  CloudView(const GaussianCloud& cloud)  // NOLINT: implicit on purpose
      : sh_degree(cloud.sh_degree),
        means(cloud.means),
        log_scales(cloud.log_scales),
        quats(cloud.quats),
        opacity_logits(cloud.opacity_logits),
        sh(cloud.sh),
        render_mode(cloud.render_mode),
        comments(cloud.comments),
        origin(cloud.origin),
        double_means(cloud.double_means) {}

  int64_t size() const { return static_cast<int64_t>(opacity_logits.size()); }
  bool empty() const { return opacity_logits.empty(); }
  int coefficients() const { return ShCoefficients(sh_degree); }
  int64_t sh_stride() const { return int64_t{3} * coefficients(); }  // floats of `sh` per Gaussian
};

// As in core/gaussian_cloud.h.
Status Validate(const CloudView& cloud);
std::optional<Bounds> ComputeBounds(const CloudView& cloud);

// Deep copies of the whole view and of the given rows, in that order. Errors: those of Validate; a row out of range.
GaussianCloud CopyOf(const CloudView& view);
Result<GaussianCloud> Subset(const CloudView& view, std::span<const int64_t> rows);

}  // namespace anchorsplat
