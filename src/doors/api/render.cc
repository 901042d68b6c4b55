#include <anchorsplat/render.h>

#include <numbers>

#include "api/bridge.h"
#include "cameras/camera_io.h"
#include "core/framing.h"
#include "core/log.h"
#include "core/splat_comments.h"
#include "core/text.h"
#include "core/world_up.h"
#include "render/constant_cloud.h"
#include "render/rasterizer.h"
#include "render/shown_range.h"

namespace anchorsplat {

namespace {

Result<std::vector<PinholeCamera>> Orbit(const CloudView& cloud, int count, int width, int height, double fov) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(cloud));
  if (width < 1 || height < 1 || width > kMaxImageSide || height > kMaxImageSide) {
    return Error{ErrorCode::kBadArgument,
                 Cat("pictures of ", width, " x ", height, " pixels; each side must be 1 to ", kMaxImageSide)};
  }
  if (!(fov > 0 && fov < 180)) {
    return Error{ErrorCode::kBadArgument, Cat("a field of view of ", fov, " degrees is not between 0 and 180")};
  }
  const Pinhole intrinsics = PinholeFromFov(width, height, fov * std::numbers::pi / 180);
  const Framing framing = FrameCloud(cloud);
  const std::vector<std::string> comments(cloud.comments.begin(), cloud.comments.end());
  ANCHORSPLAT_ASSIGN_OR_RETURN(const CameraSet orbit,
                               UprightOrbit(count, FramingDistance(framing, intrinsics), framing.target,
                                            UpOf(comments).value_or(kUsualUp), intrinsics));
  std::vector<PinholeCamera> cameras;
  for (const Camera& camera : orbit.cameras) cameras.push_back(ToPinhole(camera));
  return cameras;
}

RenderOptions ToOptions(const CloudView& cloud, const RenderSettings& settings) {
  RenderOptions options = DisplayOptions(cloud);
  options.background = settings.background;
  options.mode = ToMode(settings.rasterization).value_or(options.mode);
  if (settings.near_plane) {
    options.near_plane = *settings.near_plane;
    options.subject.reset();  // near_plane was given
  }
  if (settings.far_plane) options.far_plane = *settings.far_plane;
  options.sh_degree = settings.sh_degree;
  options.depth = settings.depth;
  return options;
}

Result<std::vector<Rendering>> Draw(const CloudView& cloud, std::span<const PinholeCamera> cameras,
                                    const RenderSettings& settings) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(cloud));
  const RenderOptions options = ToOptions(cloud, settings);
  ConstantCloud still(cloud);
  Rasterizer rasterizer;
  std::vector<Camera> views;
  for (const PinholeCamera& camera : cameras) views.push_back(ToCamera(camera));
  std::vector<Rendering> renderings;
  Progress progress("render", static_cast<int64_t>(cameras.size()));
  const auto keep = [&](size_t k, RenderOutput& output) -> Status {
    const int64_t visible = rasterizer.statistics().visible;
    if (const std::string nothing = EmptyPictureReason(cloud, views[k], options, visible); !nothing.empty()) {
      LogWarning(nothing);
    }
    renderings.push_back({.color = ToPicture(output.color),
                          .alpha = ToPicture(output.alpha),
                          .depth = ToPicture(output.depth),
                          .visible = visible});
    progress.Advance();
    if (!StopRequested() || renderings.size() == cameras.size()) return {};
    return Error{ErrorCode::kInterrupted, Cat("stopped after ", renderings.size(), " of ", cameras.size(), " views")};
  };
  if (StopRequested()) return Error{ErrorCode::kInterrupted, Cat("stopped after 0 of ", cameras.size(), " views")};
  ANCHORSPLAT_RETURN_IF_ERROR(rasterizer.RenderEach(still, views, options, keep));
  return renderings;
}

}  // namespace

Expected<std::vector<PinholeCamera>> OrbitAround(const SplatView& splat, int count, int width, int height, double fov) {
  return InRun<std::vector<PinholeCamera>>({}, [&] { return Orbit(ToCloud(splat), count, width, height, fov); });
}

Expected<std::vector<PinholeCamera>> ReadCameraFile(const std::filesystem::path& path) {
  return InRun<std::vector<PinholeCamera>>({}, [&]() -> Result<std::vector<PinholeCamera>> {
    ANCHORSPLAT_ASSIGN_OR_RETURN(const CameraSet set, ReadCameras(path));
    std::vector<PinholeCamera> cameras;
    for (const Camera& camera : set.cameras) cameras.push_back(ToPinhole(camera));
    return cameras;
  });
}

Expected<std::vector<Rendering>> RenderViews(const SplatView& splat, std::span<const PinholeCamera> cameras,
                                             const RenderSettings& settings, const RunSettings& run) {
  return InRun<std::vector<Rendering>>(run, [&] { return Draw(ToCloud(splat), cameras, settings); });
}

Expected<Rendering> Render(const SplatView& splat, const PinholeCamera& camera, const RenderSettings& settings,
                           const RunSettings& run) {
  return InRun<Rendering>(run, [&]() -> Result<Rendering> {
    ANCHORSPLAT_ASSIGN_OR_RETURN(std::vector<Rendering> one, Draw(ToCloud(splat), {&camera, 1}, settings));
    return std::move(one.front());
  });
}

}  // namespace anchorsplat
