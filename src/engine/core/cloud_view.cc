#include "core/cloud_view.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/statistics.h"
#include "core/text.h"

namespace anchorsplat {

Status Validate(const CloudView& cloud) {
  if (cloud.sh_degree < 0 || cloud.sh_degree > kMaxShDegree) {
    return Error{ErrorCode::kBadArgument, Cat("SH degree ", cloud.sh_degree, " is not 0 to ", kMaxShDegree)};
  }
  const size_t n = cloud.opacity_logits.size();
  const auto check = [n](std::span<const float> array, int64_t width, const char* name) -> Status {
    if (array.size() == n * static_cast<size_t>(width)) return {};
    return Error{ErrorCode::kBadArgument,
                 Cat("Gaussian cloud: ", name, " has ", array.size(), " values, expected ", n, " x ", width)};
  };
  ANCHORSPLAT_RETURN_IF_ERROR(check(cloud.means, 3, "means"));
  ANCHORSPLAT_RETURN_IF_ERROR(check(cloud.log_scales, 3, "log_scales"));
  ANCHORSPLAT_RETURN_IF_ERROR(check(cloud.quats, 4, "quats"));
  return check(cloud.sh, cloud.sh_stride(), "sh");
}

std::optional<Bounds> ComputeBounds(const CloudView& cloud) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  Bounds box{{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}};
  for (int64_t i = 0; i < cloud.size(); ++i) {
    if (!HasUsableShape(cloud, i)) continue;
    const float* p = &cloud.means[static_cast<size_t>(3 * i)];
    for (size_t a = 0; a < 3; ++a) {
      box.min[a] = std::min(box.min[a], p[a]);
      box.max[a] = std::max(box.max[a], p[a]);
    }
  }
  if (box.min[0] > box.max[0]) return std::nullopt;
  return box;
}

GaussianCloud CopyOf(const CloudView& view) {
  GaussianCloud cloud;
  cloud.sh_degree = view.sh_degree;
  cloud.means.assign(view.means.begin(), view.means.end());
  cloud.log_scales.assign(view.log_scales.begin(), view.log_scales.end());
  cloud.quats.assign(view.quats.begin(), view.quats.end());
  cloud.opacity_logits.assign(view.opacity_logits.begin(), view.opacity_logits.end());
  cloud.sh.assign(view.sh.begin(), view.sh.end());
  cloud.render_mode = view.render_mode;
  cloud.comments.assign(view.comments.begin(), view.comments.end());
  cloud.origin = view.origin;
  cloud.double_means = view.double_means;
  return cloud;
}

Result<GaussianCloud> Subset(const CloudView& view, std::span<const int64_t> rows) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(view));
  for (const int64_t row : rows) {
    if (row < 0 || row >= view.size()) {
      return Error{ErrorCode::kBadArgument, Cat("row ", row, " of a cloud of ", view.size(), " Gaussians")};
    }
  }
  const auto gather = [&rows](std::span<const float> from, int64_t width, Buffer<float>& to) {
    to.resize(rows.size() * static_cast<size_t>(width));
    float* out = to.data();
    for (const int64_t row : rows) out = std::copy_n(from.data() + row * width, width, out);
  };
  GaussianCloud out;
  out.sh_degree = view.sh_degree;
  out.render_mode = view.render_mode;
  out.comments.assign(view.comments.begin(), view.comments.end());
  out.origin = view.origin;
  out.double_means = view.double_means;
  gather(view.means, 3, out.means);
  gather(view.log_scales, 3, out.log_scales);
  gather(view.quats, 4, out.quats);
  gather(view.opacity_logits, 1, out.opacity_logits);
  gather(view.sh, view.sh_stride(), out.sh);
  return out;
}

}  // namespace anchorsplat
