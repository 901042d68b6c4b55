#include "enhance/pixel_size.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>
#include <vector>

#include "core/parallel.h"
#include "core/statistics.h"
#include "core/text.h"
#include "enhance/camera_rule.h"
#include "render/shown_range.h"

namespace anchorsplat {

namespace {

constexpr int64_t kGaussiansPerTask = 4096;

// A camera in single precision with precomputed projection terms: scenes have millions of Gaussians and thousands of
// views.
struct View {
  float r[9];
  float t[3];
  float center[3];
  float x0, x1, y0, y1;  // x/z and y/z at the image borders
  float focal;           // sqrt(fx·fy)
  float near;            // z of the near plane
};

View MakeView(const Camera& camera, const RenderOptions& shown) {
  View view{};
  const Pinhole& k = camera.intrinsics;
  std::transform(camera.world_to_camera.rotation.begin(), camera.world_to_camera.rotation.end(), view.r,
                 [](double x) { return static_cast<float>(x); });
  std::transform(camera.world_to_camera.translation.begin(), camera.world_to_camera.translation.end(), view.t,
                 [](double x) { return static_cast<float>(x); });
  const auto center = camera.Center();
  std::transform(center.begin(), center.end(), view.center, [](double x) { return static_cast<float>(x); });
  view.x0 = static_cast<float>(-k.cx / k.fx);
  view.x1 = static_cast<float>((k.width - k.cx) / k.fx);
  view.y0 = static_cast<float>(-k.cy / k.fy);
  view.y1 = static_cast<float>((k.height - k.cy) / k.fy);
  view.focal = static_cast<float>(std::sqrt(k.fx * k.fy));
  view.near = NearPlane(shown, camera);
  return view;
}

}  // namespace

Result<CameraPixelSizes> PixelSizesFromCameras(const GaussianCloud& cloud, const CameraSet& cameras,
                                               CameraPixelRule rule) {
  if (cameras.cameras.empty()) return Error{ErrorCode::kBadArgument, "no cameras to take the pixel size from"};
  std::vector<View> views;
  const RenderOptions shown = DisplayOptions(cloud);
  for (const Camera& camera : cameras.cameras) views.push_back(MakeView(camera, shown));

  CameraPixelSizes out;
  if (rule == CameraPixelRule::kAuto) {
    CameraRuleChoice choice = ChooseCameraRule(cloud, cameras);
    rule = choice.rule;
    out.why = std::move(choice.why);
  }
  out.rule = rule;
  out.sizes.resize(static_cast<size_t>(cloud.size()));
  std::atomic<int64_t> unseen = 0;
  ParallelFor(0, cloud.size(), kGaussiansPerTask, [&](int64_t first, int64_t last) {
    int64_t missed = 0;
    Buffer<float> seen;
    for (int64_t i = first; i < last; ++i) {
      const float* p = cloud.means.data() + 3 * i;
      float size = std::numeric_limits<float>::infinity();
      seen.clear();
      for (const View& v : views) {
        const float z = v.r[6] * p[0] + v.r[7] * p[1] + v.r[8] * p[2] + v.t[2];
        if (!(z > v.near)) continue;
        const float x = v.r[0] * p[0] + v.r[1] * p[1] + v.r[2] * p[2] + v.t[0];
        const float y = v.r[3] * p[0] + v.r[4] * p[1] + v.r[5] * p[2] + v.t[1];
        if (x < v.x0 * z || x > v.x1 * z || y < v.y0 * z || y > v.y1 * z) continue;
        size = std::min(size, z / v.focal);
        if (rule == CameraPixelRule::kMedian) seen.push_back(z / v.focal);
      }
      if (!seen.empty()) size = Quantile(seen, 0.5);
      if (!std::isfinite(size)) {
        ++missed;
        for (const View& v : views) {
          const float d[3] = {p[0] - v.center[0], p[1] - v.center[1], p[2] - v.center[2]};
          const float distance = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
          if (distance > 0) size = std::min(size, distance / v.focal);
        }
      }
      out.sizes[static_cast<size_t>(i)] = size;
    }
    unseen += missed;
  });
  out.unseen = unseen;

  Buffer<float> finite;
  std::copy_if(out.sizes.begin(), out.sizes.end(), std::back_inserter(finite),
               [](float x) { return std::isfinite(x); });
  out.median = Quantile(finite, 0.5);
  for (float& size : out.sizes) {
    if (!std::isfinite(size)) size = out.median;
  }
  return out;
}

CameraSet AtTrainWidth(CameraSet cameras, int train_width) {
  for (Camera& camera : cameras.cameras) {
    Pinhole& k = camera.intrinsics;
    if (k.width > train_width) k = Scaled(k, static_cast<double>(train_width) / k.width);
  }
  return cameras;
}

int WidestOf(std::span<const Camera> cameras) {
  int widest = 0;
  for (const Camera& camera : cameras) widest = std::max(widest, camera.intrinsics.width);
  return widest;
}

std::optional<int> AssumedTrainWidth(const CameraSet& cameras) {
  if (cameras.source != CameraSource::kInria && cameras.source != CameraSource::kColmap) return std::nullopt;
  return WidestOf(cameras.cameras) > kInriaTrainWidth ? std::optional(kInriaTrainWidth) : std::nullopt;
}

}  // namespace anchorsplat
