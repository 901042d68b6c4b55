#include "core/gaussian_cloud.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <new>

#include "core/activations.h"
#include "core/cloud_view.h"
#include "core/finite.h"
#include "core/statistics.h"
#include "core/text.h"

namespace anchorsplat {

namespace {

void AppendRows(Buffer<float>& to, const Buffer<float>& from) { to.insert(to.end(), from.begin(), from.end()); }

}  // namespace

int64_t GaussianCloud::bytes() const {
  return static_cast<int64_t>(sizeof(float) *
                              (means.size() + log_scales.size() + quats.size() + opacity_logits.size() + sh.size()));
}

void GaussianCloud::Resize(int64_t n, int degree) {
  sh_degree = degree;
  // Where addresses have 32 bits a count that passed all checks may still be more floats than there are addresses.
  if (static_cast<uint64_t>(n) > sh.max_size() / static_cast<size_t>(sh_stride())) throw std::bad_alloc();
  const size_t count = static_cast<size_t>(n);
  means.resize(3 * count);
  log_scales.resize(3 * count);
  quats.resize(4 * count);
  opacity_logits.resize(count);
  sh.resize(count * static_cast<size_t>(sh_stride()));
}

Status Validate(const GaussianCloud& cloud) { return Validate(CloudView(cloud)); }

std::optional<Bounds> ComputeBounds(const GaussianCloud& cloud) { return ComputeBounds(CloudView(cloud)); }

Result<GaussianCloud> Subset(const GaussianCloud& cloud, std::span<const int64_t> rows) {
  return Subset(CloudView(cloud), rows);
}

Status Append(GaussianCloud& cloud, const GaussianCloud& more) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(cloud));
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(more));
  if (cloud.sh_degree < more.sh_degree) cloud = WithShDegree(cloud, more.sh_degree);
  const auto first = static_cast<int64_t>(cloud.means.size());
  AppendRows(cloud.means, more.means);
  if (more.origin != cloud.origin) {
    for (int64_t i = first; i < std::ssize(cloud.means); i += 3) {
      const std::array<double, 3> at = RelativeToOrigin(ToWorld(cloud.means.data() + i, more.origin), cloud.origin);
      std::ranges::transform(at, cloud.means.data() + i, [](double x) { return static_cast<float>(x); });
    }
  }
  AppendRows(cloud.log_scales, more.log_scales);
  AppendRows(cloud.quats, more.quats);
  AppendRows(cloud.opacity_logits, more.opacity_logits);
  AppendRows(cloud.sh, more.sh_degree == cloud.sh_degree ? more.sh : WithShDegree(more, cloud.sh_degree).sh);
  return {};
}

GaussianCloud WithShDegree(const GaussianCloud& cloud, int degree) {
  GaussianCloud out = cloud;
  if (degree == cloud.sh_degree) return out;
  out.sh_degree = degree;
  out.sh.assign(static_cast<size_t>(cloud.size() * out.sh_stride()), 0.0f);
  const int64_t kept = std::min(cloud.sh_stride(), out.sh_stride());
  for (int64_t i = 0; i < cloud.size(); ++i) {
    std::copy_n(cloud.sh.data() + i * cloud.sh_stride(), kept, out.sh.data() + i * out.sh_stride());
  }
  return out;
}

namespace {

// Of a GaussianCloud or a CloudView; making the one into the other for every row would cost more than the look.
template <typename Cloud>
bool ShapeIsUsable(const Cloud& cloud, int64_t i) {
  const float* scales = cloud.log_scales.data() + 3 * i;
  return AllFinite(cloud.means.data() + 3 * i, 3) &&
         std::all_of(scales, scales + 3, [](float x) { return x <= kMaxLogScale; }) &&  // false for NaN
         AllFinite(cloud.quats.data() + 4 * i, 4) && !std::isnan(cloud.opacity_logits[static_cast<size_t>(i)]);
}

template <typename Cloud>
bool HarmonicsAreFinite(const Cloud& cloud, int64_t i) {
  return AllFinite(cloud.sh.data() + i * cloud.sh_stride(), cloud.sh_stride());
}

}  // namespace

bool HasUsableShape(const CloudView& cloud, int64_t i) { return ShapeIsUsable(cloud, i); }
bool IsUsable(const CloudView& cloud, int64_t i) { return ShapeIsUsable(cloud, i) && HarmonicsAreFinite(cloud, i); }
bool IsUsable(const GaussianCloud& cloud, int64_t i) { return ShapeIsUsable(cloud, i) && HarmonicsAreFinite(cloud, i); }

bool IsOpaqueEnough(float logit) { return Sigmoid(logit) >= kMinOpacity; }
bool IsDrawn(const CloudView& cloud, int64_t i) {
  return IsOpaqueEnough(cloud.opacity_logits[static_cast<size_t>(i)]) && IsUsable(cloud, i);
}
bool IsDrawn(const GaussianCloud& cloud, int64_t i) {
  return IsOpaqueEnough(cloud.opacity_logits[static_cast<size_t>(i)]) && IsUsable(cloud, i);
}

bool IsFinite(const GaussianCloud& cloud, int64_t i) {
  return IsUsable(cloud, i) && AllFinite(cloud.log_scales.data() + 3 * i, 3) &&
         std::isfinite(cloud.opacity_logits[static_cast<size_t>(i)]);
}

}  // namespace anchorsplat
