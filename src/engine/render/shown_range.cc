#include "render/shown_range.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/statistics.h"
#include "core/text.h"
#include "render/constants.h"

namespace anchorsplat {

namespace {

constexpr int64_t kAlmostNothing = 1000;  // 1 of 1,000 Gaussians

// Counts of Gaussians along the viewing axis.
struct Depths {
  int64_t behind = 0, too_near = 0, in_range = 0, too_far = 0;
  int64_t faint = 0, unusable = 0;  // in range, but not drawn
};

Depths CountDepths(const CloudView& cloud, const Camera& camera, double near, double far) {
  Depths depths;
  for (int64_t i = 0; i < cloud.size(); ++i) {
    const float* p = cloud.means.data() + 3 * i;
    const double z = camera.ToCamera(ToWorld(p, cloud.origin))[2];
    if (!std::isfinite(z)) continue;
    int64_t& where = z <= 0 ? depths.behind : z < near ? depths.too_near : z > far ? depths.too_far : depths.in_range;
    ++where;
    if (&where != &depths.in_range) continue;
    if (!IsUsable(cloud, i)) {
      ++depths.unusable;
    } else if (!IsOpaqueEnough(cloud.opacity_logits[static_cast<size_t>(i)])) {
      ++depths.faint;
    }
  }
  return depths;
}

}  // namespace

RenderOptions DisplayOptions(const CloudView& cloud) {
  RenderOptions options;
  options.mode = cloud.render_mode.value_or(RenderMode::kClassic);
  options.subject = FrameCloud(cloud);
  options.far_plane = kNoFar;
  return options;
}

float NearPlane(const RenderOptions& options, const Camera& camera) {
  if (!options.subject) return options.near_plane;
  const auto middle = camera.ToCamera(options.subject->target);
  const double distance = std::max(std::hypot(middle[0], middle[1], middle[2]), options.subject->radius);
  // NaN and overflow leave the plane unchanged.
  const auto share = static_cast<float>(std::min(double{kNearShare} * distance, double{options.near_plane}));
  return share >= std::numeric_limits<float>::min() ? share : options.near_plane;
}

std::string EmptyPictureReason(const CloudView& cloud, const Camera& camera, const RenderOptions& options,
                               std::optional<int64_t> drawn) {
  if (cloud.empty() || drawn.value_or(0) * kAlmostNothing >= cloud.size()) return {};
  const float near = NearPlane(options, camera);
  const Depths depths = CountDepths(cloud, camera, near, options.far_plane);
  if (drawn.value_or(1) > 0 && depths.in_range * kAlmostNothing >= cloud.size()) return {};
  std::string where;
  const auto add = [&where](int64_t count, const std::string& place) {
    if (count > 0) where += Cat(where.empty() ? "" : ", ", WithThousands(count), " ", place);
  };
  add(depths.behind, "behind the camera");
  add(depths.too_near, Cat("before the near plane (", near, ")"));
  add(depths.too_far, Cat("beyond the far plane (", options.far_plane, ")"));
  add(depths.faint, "less opaque than 1/255");
  add(depths.unusable, Cat("not drawable (", kWhyUnusable, ")"));
  add(depths.in_range - depths.faint - depths.unusable,
      drawn.value_or(1) == 0 ? "in range but beside the picture" : "in range");
  return Cat("view ", Printable(camera.name), " shows ", drawn.value_or(1) == 0 ? "nothing" : "almost nothing",
             " of the ", WithThousands(cloud.size()), " Gaussians: ", where.empty() ? "none has a position" : where,
             "; are these cameras of this splat, in its unit and its axes?");
}

}  // namespace anchorsplat
